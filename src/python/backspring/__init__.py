"""Implicit solver for mass-spring systems: equilibria, modes, moduli and motions of networks that are NumPy arrays.

    import backspring as bs
    net = bs.Lattice(x, pairs, stiffness=k, rest_length=L, mass=m, fixed=[0, 7], groups={"top": rows})
    eq = bs.statics(net, loads={"top": (0, -5.0)}, load_steps=10)
    eq.x, eq.tension, eq.reactions["held"]

Units are the user's own, as long as they agree with one another: nothing is converted. Every option of the program is a keyword by its name without the
dash: ``snes_rtol=1e-12``, ``bs_gravity=(0, -9.81)``. What is computed is what the program computes, bit for bit on the same number of ranks.
"""

from .analyses import moduli, modes, statics
from .breaks import Events
from .changes import Statics
from .errors import BackspringWarning, ConvergenceError, Error, FileError, InputError, Stopped
from .forces import Forces
from .frames import Frame
from .lattice import Lattice
from .motion import Simulation
from .reading import generate, read
from .results import Equilibrium, Moduli, Modes
from .stepping import run
from .trajectories import open

__version__ = "0.2.0"

__all__ = [
    "BackspringWarning", "ConvergenceError", "Equilibrium", "Error", "Events", "FileError", "Forces", "Frame", "InputError", "Lattice", "Moduli", "Modes", "Simulation", "Statics", "Stopped",
    "generate", "moduli", "modes", "open", "read", "run", "statics",
]
