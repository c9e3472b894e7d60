"""What three ranks do together: forces of supports, and loops over motions that some of them leave."""
import os
import subprocess
import sys

from helpers import HERE, PROGRAM, PYTHON

HEAD = f"""
import sys
sys.path.insert(0, {str(HERE)!r}); sys.argv[1:] = ["--program", {str(PROGRAM)!r}]
import backspring as bs, numpy as np
from mpi4py import MPI
from cases import sheet
rank, net = MPI.COMM_WORLD.rank, bs.Lattice(**sheet())
say = lambda *words: [print(one) for one in MPI.COMM_WORLD.gather(' '.join(map(str, words))) or []]
"""


def spoken(code, timeout=60):
    """Of a script on three ranks: how it ended, its lines in order, and its errors."""
    environment = dict(os.environ, PYTHONPATH=PYTHON, SCOTCH_PTHREAD_NUMBER="1")
    done = subprocess.run(["mpirun", "-n", "3", sys.executable, "-c", HEAD + code], capture_output=True, text=True, timeout=timeout, env=environment)
    return done.returncode, sorted(done.stdout.splitlines()), done.stderr


def balanced_on_ranks():
    """The forces of supports are those of one rank, on all of them."""
    code, said, errors = spoken("import analyses; analyses.balanced(); say(rank, 'balanced')")
    assert code == 0 and said == [f"{k} balanced" for k in range(3)], (said, errors)
