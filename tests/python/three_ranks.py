"""What three ranks do together: forces of supports, and loops over motions that some of them leave."""
from helpers import PROGRAM, python

HEAD = f"""
import sys
sys.argv[1:] = ["--program", {str(PROGRAM)!r}]
import backspring as bs, numpy as np
from mpi4py import MPI
from cases import sheet
rank, net = MPI.COMM_WORLD.rank, bs.Lattice(**sheet())
say = lambda *words: [print(one) for one in MPI.COMM_WORLD.gather(' '.join(map(str, words))) or []]
"""


def spoken(code, timeout=60):
    """Of a script on three ranks: how it ended, its lines in order, and its errors, without what Open MPI 5 says of networks where there is none: [HOST]..."""
    done = python(HEAD + code, 3, timeout=timeout)
    errors = [line for line in done.stderr.splitlines() if not (line.startswith("[") and "/opal/" in line)]
    return done.returncode, sorted(done.stdout.splitlines()), "\n".join(errors)


def balanced_on_ranks():
    """The forces of supports balance the loads, on all ranks; views of the state are refused."""
    code, said, errors = spoken("""
import analyses
analyses.balanced()
try: bs.Simulation(net, dt=1e-3, bs_ordering="rows").view("position")
except bs.InputError as error: say(rank, "balanced", "several ranks" in str(error))
""")
    assert code == 0 and said == [f"{k} balanced True" for k in range(3)], (said, errors)


def kicked_on_ranks():
    """Forces that are drawn once a step move a chain as on one rank, and those that limit steps keep two apart that other ranks may own."""
    for name in ("kicked_chain", "flying_pair"):
        code, said, errors = spoken(f"import own_laws\nown_laws.{name}()\nsay(rank, 'done')\n", timeout=120)
        assert code == 0 and said == [f"{k} done" for k in range(3)], (name, said, errors)


LOOP = """
try:
    for frame in bs.run(net, dt=1e-3, until=4e-3):
        {body}
    found = "went through"
except Exception as error: found = type(error).__name__ + (" by another" if "another rank left the loop" in str(error) else "")
say(rank, found, bs.Simulation(net, dt=1e-3).steps)
"""


def loops_left():
    """A loop over a motion that some ranks leave ends on all: those that stay are told, and all can go on. Leaving together is nothing to tell."""
    stopped, error = "Stopped by another", "ZeroDivisionError"
    for body, expected in (("if rank == 1 and frame.t > 1.5e-3: 1 / 0", (stopped, error, stopped)), ("if rank != 1: 1 / 0", (error, stopped, error)),
                           ("if frame.t > 1.5e-3: 1 / 0", (error,) * 3), ("if frame.t > 1.5e-3: break", ("went through",) * 3),
                           ("if rank == 2 and frame.t > 3.5e-3: break", (stopped, stopped, "went through")), ("frame.v *= 0.5 + 0.1 * (rank == 0)", ("went through",) * 3)):
        code, said, errors = spoken(LOOP.format(body=body))
        assert code == 0 and said == [f"{k} {one} 0" for k, one in enumerate(expected)] and not errors, (body, said, errors)


def loops_at_the_end():
    """An exception that nothing catches while a variable holds the loop ends all ranks; loops that all have left when the interpreter ends end silently."""
    held = "frames = bs.run(net, dt=1e-3, until=4e-3)\n"
    code, said, errors = spoken(held + "for frame in frames:\n    if rank == 1: raise KeyError('here')\n")
    assert code != 0 and not said and "KeyError: 'here'" in errors, (said, errors)
    code, said, errors = spoken(held + "next(frames); say(next(frames).t)\n")
    assert code == 0 and said == ["0.001"] * 3 and not errors, (said, errors)
