"""Where the energy of a run went: the work that was done on it, what it dissipated, broke and released, and what no book tells of."""
import numpy as np

BOOKS = {"dissipated": "D", "broken": "B", "released": "R"}  # observables NAME_energy [J], each with its sign in formulas


def work_of(run):
    """Work of all that is driven (T,), 0 where nothing is."""
    done = [value for name, value in run.series.items() if name.startswith("work/")]
    return np.sum(done, axis=0) if done else np.zeros(len(run.observable_times))


def books_of(run):
    """{name: (T,)} of what left the system since the first frame and is booked; what is 0 throughout is left out."""
    found = {name: run.series.get(name + "_energy") for name in BOOKS}
    since = {name: value - value[0] for name, value in found.items() if value is not None}
    return {name: value for name, value in since.items() if np.any(value)}


def lost_of(run):
    """(T,) E_0 + W - E less what is booked: what dampers took, and the error of the steps. None without a total energy, and in statics, where W is summed over load steps by the
    trapezoidal rule, so that with few of them it is the error of that sum."""
    total = run.series.get("total_energy")
    return None if total is None or run.static else total[0] + work_of(run) - total - sum(books_of(run).values())


def signs(runs):
    """What formulas of these runs have beside E and E_0: "+W" or nothing, and the booked, "-D-B-R", of those that are there."""
    work = "+W" if any(np.any(work_of(run)) for run in runs) else ""
    return work, "".join("-" + sign for name, sign in BOOKS.items() if any(name in books_of(run) for run in runs))
