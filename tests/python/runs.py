#!/usr/bin/env python3
"""Runs that are watched, stopped, broken, saved and continued from Python, on one rank and several: by the program's files, closed forms, and runs that
were not disturbed."""
import concurrent.futures
import contextlib
import gc
import os
import pathlib
import sys
import tempfile
import threading
import time
import warnings
import weakref

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from helpers import HERE, PROGRAM, python, raised  # noqa: E402

import backspring as bs  # noqa: E402
import h5py  # noqa: E402
import numpy as np  # noqa: E402
from cases import cell, sheet  # noqa: E402
from mpi4py import MPI  # noqa: E402

RANK, SIZE = MPI.COMM_WORLD.rank, MPI.COMM_WORLD.size


@contextlib.contextmanager
def shared_folder():
    """The same on all ranks, until all have left it."""
    with tempfile.TemporaryDirectory() as own:
        yield pathlib.Path(MPI.COMM_WORLD.bcast(own))
        MPI.COMM_WORLD.barrier()


def stopped():
    """The step in which one rank says so is the last, on all of them; what follows is what would have followed."""
    net = bs.Lattice(**sheet())
    options = dict(dt=1e-3, bs_gravity=(0, -9.81), ts_type="cn")
    seen = []
    stop = lambda t, frame: seen.append(t) or (RANK == SIZE - 1 and len(seen) == 7)
    frames = list(bs.run(net, until=0.05, every=4e-3, stop=stop, **options))
    assert np.allclose([f.t for f in frames], [0, 0.004, 0.007], rtol=0, atol=1e-12) and len(seen) == 7, ([f.t for f in frames], seen)
    undisturbed = bs.Simulation(net, **options)
    undisturbed.step(7)
    assert np.array_equal(frames[-1].x, undisturbed.x) and np.array_equal(frames[-1].v, undisturbed.v)
    for call in (lambda s: s.run_until(1.0), lambda s: s.step(100)):
        here = bs.Simulation(net, stop=lambda t, frame: frame.x[3, 1] < undisturbed.x[3, 1] + 1e-12, **options)
        call(here)
        assert here.stopped and here.steps == 7, here.steps
        here._stop = None
        here.step(3)
        assert not here.stopped and here.steps == 10
    undisturbed.step(3)
    assert np.array_equal(here.x, undisturbed.x)
    assert len(list(bs.run(net, until=3e-3, stop=lambda t, frame: False, dt=1e-3))) == 4


def observed():
    """Called after every step with the state of then; what it raises ends the call at that step, and the run can go on."""
    net, seen, kept = bs.Lattice(**sheet()), [], []

    def observe(t, frame):
        seen.append((t, frame.energy, frame.x.copy()))
        kept.append(frame)

    frames = list(bs.run(net, dt=1e-3, until=6e-3, every=2e-3, observe=observe))
    assert len(seen) == 6 and [f.t for f in frames[1:]] == [seen[k][0] for k in (1, 3, 5)]
    assert all(np.array_equal(f.x, seen[k][2]) and f.energy == seen[k][1] for f, k in zip(frames[1:], (1, 3, 5)))
    assert kept[0].energy == seen[0][1] and frames[1].observables["kinetic_energy"] > 0  # they are kept
    run = bs.run(net, dt=1e-3, until=6e-3)
    first = next(run)
    assert first.forces.shape == net.x.shape
    next(run)
    with raised(bs.Error, "gone on"):
        first.forces
    assert first.energy == frames[0].energy

    def failing(t, frame):
        if RANK == 0 and t > 2.5e-3:
            raise KeyError("enough")

    simulation = bs.Simulation(net, dt=1e-3, observe=failing)
    with raised(KeyError if RANK == 0 else bs.Stopped):
        simulation.run_until(1.0)
    assert simulation.steps == 3 and not simulation.stopped
    simulation._observe = None
    simulation.step(2)
    assert simulation.steps == 5
    with raised(bs.InputError, "observe", "function"):
        bs.Simulation(net, dt=1e-3, observe=3)
    run = bs.run(net, dt=1e-3, until=1.0, every=0.5, stop=failing)
    next(run)
    with raised(KeyError if RANK == 0 else bs.Stopped):
        next(run)


def bundle(limits):
    """Fibres side by side between a wall and a ring, of stiffness 1 and length 1."""
    n = len(limits)
    return bs.Lattice([[0.0], [1.0]], [[0, 1]] * n, stiffness=1.0, rest_length=1.0, fixed=[0], groups={"ring": [1]}, parallel=True,
                      breaking={"critical_force": limits})


def broken():
    """A bundle of fibres: those whose share is beyond what they bear are gone, at that load; a net in motion: what the program writes."""
    limits = np.array([0.5, 3.0, 0.26, 2.0, 1.0, 0.24])
    expected, whole = [], np.ones(6, bool)
    for step in range(1, 11):
        while (gone := whole & (0.21 * step / max(whole.sum(), 1) >= limits)).any():
            expected += [(step / 10, row) for row in np.flatnonzero(gone)]
            whole &= ~gone
    eq = bs.statics(bundle(limits), loads={"ring": 2.1}, load_steps=10)
    events = eq.events
    assert len(events) == len(expected) == 3 and np.array_equal(eq.broken, ~whole), (events.spring, expected)
    assert np.allclose(events.load, [load for load, _ in expected]) and events.spring.tolist() == [row for _, row in expected]
    assert events.ends.tolist() == [[0, 1]] * 3 and np.allclose(events.energy, events.strain**2 / 2) and len(set(events.avalanche)) >= 2
    assert np.isnan(eq.tension[~whole]).all() and np.allclose(eq.tension[whole], 0.7) and "3 springs broken" in repr(eq)
    plain = bs.statics(bs.Lattice(**sheet()))
    assert len(plain.events) == 0 and plain.events.ends.shape == (0, 2) and plain.broken.shape == (101,) and not plain.broken.any()
    net = bs.Lattice(**{**sheet(), "breaking": {"critical_strain": np.random.default_rng(1).uniform(0.02, 0.4, 101)}})
    with shared_folder() as folder:
        simulation = bs.Simulation(net, dt=2e-3, bs_gravity=(0, -30.0), ts_type="verlet", bs_output=folder / "run.h5md")
        counts = []
        for _ in range(4):
            simulation.step(60)
            counts.append(len(simulation.events))
            assert simulation.broken.sum() == counts[-1] == len(set(simulation.events.spring))
        events, flags = simulation.events, simulation.broken
        simulation.close()
        with h5py.File(folder / "run.h5md") as f:
            for name in ("time", "load", "spring", "ends", "strain", "energy", "avalanche"):
                assert np.array_equal(f[f"events/broken/{name}"][...], getattr(events, name)), name
            assert np.array_equal(f["backspring/broken/value"][-1] > 0, flags)
    assert 0 < counts[0] < counts[-1] < 101 and (np.diff(events.time) >= 0).all(), counts


def saved():
    """What goes on from a checkpoint is what would have gone on; names that are taken, and other lattices, are refused."""
    net = bs.Lattice(**{**sheet(), "breaking": {"critical_strain": np.linspace(0.01, 0.1, 101)}})
    with shared_folder() as folder:
        for options in (dict(ts_type="cn"), dict(ts_type="bdf", ts_bdf_order=2, ts_adapt_type="none"), dict(ts_type="verlet")):
            whole = bs.Simulation(net, dt=1e-3, bs_gravity=(0, -20.0), **options)
            whole.step(30)
            name = folder / f"{options['ts_type']}.checkpoint"
            whole.checkpoint(name)
            before, then = whole.x, whole.t
            whole.step(30)
            anew = bs.Simulation.restart(name, net)
            assert anew.steps == 30 and anew.t == then and np.array_equal(anew.x, before), (anew.steps, anew.t)
            anew.step(30)
            assert np.array_equal(anew.x, whole.x) and np.array_equal(anew.v, whole.v) and anew.t == whole.t, abs(anew.x - whole.x).max()
            assert len(whole.events) > 0 and np.array_equal(anew.events.spring, whole.events.spring) and np.array_equal(anew.events.time, whole.events.time)
        with raised(bs.InputError, "there already", "overwrite"):
            whole.checkpoint(name)
        whole.v = 0.5 * whole.v
        whole.checkpoint(name, overwrite=True)
        anew = bs.Simulation.restart(name, net, ts_dt=None)
        assert np.array_equal(anew.v, whole.v) and anew.t == whole.t
        anew.v = 2 * anew.v  # a state that is set begins there, not at the checkpoint
        whole.v = 2 * whole.v
        for one in (anew, whole):
            one.step(5)
        assert np.array_equal(anew.x, whole.x)
        with raised(bs.InputError):
            bs.Simulation.restart(name, net.replace(stiffness=2 * net.stiffness))
        with raised(bs.InputError, "nothing.checkpoint"):
            bs.Simulation.restart(folder / "nothing.checkpoint", net)
        with raised(bs.FileError):
            whole.checkpoint(folder / "no" / "folder")


def differing():
    """Arguments that are not the same on every rank: each of them is told which."""
    data = sheet()
    other = {**data, "stiffness": data["stiffness"] * (1 + 1e-15 * RANK * 8)}
    for name, call in (("stiffness", lambda: bs.statics(bs.Lattice(**other))), ("snes_rtol", lambda: bs.statics(bs.Lattice(**data), snes_rtol=1e-9 * (RANK + 1))),
                       ("bs_force_bottom", lambda: bs.statics(bs.Lattice(**data), loads={"bottom": (0, -float(RANK))})), ("ts_dt", lambda: bs.Simulation(bs.Lattice(**data), dt=1e-3 + RANK)),
                       ("names of options", lambda: bs.modes(bs.Lattice(**data), 2, **({"bs_gravity": (0, -1)} if RANK else {}))), ("forces", lambda: bs.Simulation(
                           bs.Lattice(**data), dt=1e-3, forces=(lambda t, x, v, rows: 0 * x) if RANK else None)), ("bs_lattice_seed", lambda: bs.generate(
                               "square", (4, 4), dim=2, seed=RANK))):
        with raised(bs.InputError, name, "rank 1", "same on every rank"):
            call()
    bs.statics(bs.Lattice(**data))


def threads():
    """Threads take turns: each finds what it would have found alone; on several ranks a simulation is its thread's."""
    nets = [bs.Lattice(**sheet()), bs.Lattice(**cell())]
    alone, found, errors = [], {}, []
    for net in nets:
        with bs.Simulation(net, dt=1e-3, ts_type="cn") as simulation:
            simulation.step(60)
            alone.append(simulation.x)

    def work(k):
        try:
            seen = []
            with bs.Simulation(nets[k], dt=1e-3, ts_type="cn", observe=lambda t, frame: seen.append(frame.x[0, 0])) as simulation:
                for _ in range(60):
                    simulation.step()
                    bs.Lattice(**sheet()).nearest_shift if k else time.sleep(1e-4)
                assert len(seen) == 60
                found[k] = simulation.x
        except Exception as error:
            errors.append(error)

    if SIZE > 1:
        simulation = bs.Simulation(nets[0], dt=1e-3)
        other = threading.Thread(target=lambda: errors.append(outcome(simulation.step)))
        other.start()
        other.join()
        assert isinstance(errors[0], RuntimeError) and "thread" in str(errors[0]), errors
        simulation.step()
        return
    both = [threading.Thread(target=work, args=(k,)) for k in (0, 1)]
    for one in both:
        one.start()
    for one in both:
        one.join()
    assert not errors, errors
    for k in (0, 1):
        assert np.array_equal(found[k], alone[k])


def waited_for():
    """A call of a thread that an observer, or forces, wait for by join() or result() is refused, also by way of a third thread; threads that are waited for by others,
    or with a limit, take their turns."""
    if SIZE > 1:
        return
    net, said = bs.Lattice(**sheet()), []

    def started(call):
        thread = threading.Thread(target=lambda: said.append(outcome(call)))
        thread.start()
        return thread

    def solve():
        bs.statics(net, bs_gravity=(0, -1.0))

    def by_future():
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            return pool.submit(solve).result()

    once = lambda call: bs.Simulation(net, dt=1e-3, observe=lambda t, frame: call()).step()
    refused = lambda error: isinstance(error, RuntimeError) and "for this one" in str(error)
    once(lambda: started(solve).join())
    once(lambda: started(lambda: started(solve).join()).join())
    assert refused(said[0]) and refused(said[1]) and said[2] is None and len(said) == 3, said
    assert refused(outcome(lambda: once(by_future)))
    forces = lambda t, x, v: (started(solve).join(), 0 * x)[1]
    bs.Simulation(net, dt=1e-3, forces=forces, ts_type="euler").step()
    assert len(said) > 3 and all(refused(one) for one in said[3:]), said
    said.clear()
    waiting = []
    once(lambda: waiting.append(started(solve)) or waiting[-1].join(timeout=0.5))
    once(lambda: waiting.append(started(solve)) or time.sleep(0.5))
    for one in waiting:
        one.join()
    assert said == [None, None], said


def outcome(call):
    """The exception of a call."""
    try:
        call()
    except Exception as error:
        return error
    return None


def collected():
    """A simulation that its observer, or its forces, refer to is freed with them, on one rank; it can be used till then."""
    if SIZE > 1:
        return
    net, freed = bs.Lattice(**sheet()), []
    for kind in ("observe", "stop", "on_step", "forces"):
        box = {}
        call = lambda *given, box=box: 0 * given[1] + 0 * len(box["one"].lattice) if kind == "forces" else bool(box["one"].t > 1)
        box["one"] = bs.Simulation(net, dt=1e-3, **({} if kind == "on_step" else {kind: call}))
        if kind == "on_step":
            box["one"].on_step(call)
        box["one"].step(2)
        freed += [weakref.ref(box["one"]), weakref.ref(box["one"]._session)]
        gc.collect()
        assert freed[-1]() is not None
        box["one"].step(1)
        del box, call
        gc.collect()
        assert freed[-2]() is None and freed[-1]() is None, kind


def warned():
    """Warnings are of the line that made the call."""
    net = bs.Lattice(**sheet())
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        simulation = bs.Simulation(net, dt=0.3, ts_type="verlet", bs_gravity=(0, -9.81)); here = sys._getframe().f_lineno  # noqa: E702
        with contextlib.suppress(bs.Error):
            simulation.step(3); here = (here, sys._getframe().f_lineno)  # noqa: E702
        list(bs.run(net, dt=0.3, until=0.6, ts_type="verlet")); here = (*here, sys._getframe().f_lineno)  # noqa: E702
    told = [one for one in found if issubclass(one.category, bs.BackspringWarning)]
    assert bool(told) == (RANK == 0), told
    assert all(one.filename == __file__ and one.lineno in here for one in told), [(one.filename, one.lineno) for one in told]


def progressing():
    """A bar on the first rank; without tqdm what to install, and only where a bar is wanted."""
    head = "import sys; sys.modules.update({'tqdm': None, 'tqdm.auto': None}) if 'without' in sys.argv else None; import backspring as bs; from cases import sheet; net = bs.Lattice(**sheet()); "
    run, statics = "list(bs.run(net, dt=1e-3, until=0.02, every=0.01{}))", "bs.statics(net, loads={{'bottom': (0, -1.0)}}, load_steps=4{})"
    for call, what in ((run, "t / s = 0.02 of 0.02"), (statics, "load = 1 of 1")):
        done = python(head + call.format(", progress=True"), ranks=RANKS)
        assert done.returncode == 0 and done.stdout == "" and "100%" in done.stderr and what in done.stderr, done.stdout + done.stderr
        assert done.stderr.count("100%") <= 3 and ("step 20" if call is run else "step 4") in done.stderr, done.stderr
        done = python(head + call.format("") + "; print([one for one in sys.modules if one.startswith('tqdm')])", ranks=RANKS)
        assert done.stderr == "" and "".join(done.stdout.split()) == "[]" * RANKS, done.stdout + done.stderr
    done = python("import sys; sys.argv.append('without'); " + head + run.format("") + "\ntry: " + run.format(", progress=True") + "\nexcept ImportError as error: print(error)", ranks=RANKS)
    assert done.returncode == 0 and done.stdout.count("apt install python3-tqdm") == RANKS, done.stdout + done.stderr


PARTS = (stopped, observed, broken, saved, differing, threads, waited_for, collected, warned)
RANKS = int(sys.argv[sys.argv.index("--ranks") + 1]) if "--ranks" in sys.argv else 1


def main():
    chosen = sys.argv[sys.argv.index("--filter") + 1] if "--filter" in sys.argv else ""
    for part in (*PARTS, progressing):
        if chosen not in part.__name__ or (part is differing and RANKS == 1):
            continue
        begin = time.time()
        if part is progressing:
            part()
        else:  # in processes of its own, for MPI is started once
            code = f"import sys; sys.argv = ['runs.py', '--program', {str(PROGRAM)!r}]; import runs; runs.{part.__name__}(); all = runs.MPI.COMM_WORLD.gather(1); print('passed on', len(all)) if all else None"
            done = python(code, ranks=RANKS, timeout=200, cwd=HERE)
            assert done.returncode == 0 and done.stdout.split() == ["passed", "on", str(RANKS)], f"{part.__name__}\n{done.stdout}{done.stderr}"
        print(f"{part.__name__}: ok, {time.time() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
