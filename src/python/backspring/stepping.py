"""Motions as iterators over their frames."""

from __future__ import annotations

from typing import Iterator, Optional, Union

import numpy as np

from .frames import Frame
from .kinds import Comm, GivenForces, Loads, Option, Shared
from .lattice import Lattice
from .motion import Observe, Simulation
from .progress import Progress
from .results import Equilibrium


def run(net: Union[Lattice, Equilibrium], *, until: float, dt: Optional[float] = None, every: Optional[float] = None, loads: Optional[Loads] = None,
        total: Shared = False, forces: Optional[GivenForces] = None, observe: Optional[Observe] = None, stop: Optional[Observe] = None, progress: bool = False,
        comm: Comm = None, **options: Option) -> Iterator[Frame]:
    """Frames of a motion from t = 0 to `until` [s], the first of them the start, then one every `every` [s] (None: after every step); steps end at them.

        for frame in bs.run(net, ts_type="cn", dt=1e-3, until=2.0, every=0.1):
            frame.v *= 0.99

    observe(t, frame) is called after every step; stop(t, frame) likewise: where it returns True the frame of this moment is the last. progress: a bar of
    tqdm. dt [s] and the rest as of Simulation; options of the program by their names. Raises InputError, and ConvergenceError whose state is the last
    good frame.
    """
    bar = Progress(progress, comm, float(options.get("ts_init_time") or 0.0), until, "t / s")
    simulation = Simulation(net, dt=dt, loads=loads, total=total, forces=forces, observe=observe, stop=stop, comm=comm,
                            **{"ts_max_time": until, "bs_output_interval": every, **options})
    if progress:
        simulation._bar = bar
        simulation._attach()
    return _frames(simulation)


def _frames(simulation: Simulation) -> Iterator[Frame]:
    with simulation:
        while True:
            frame = simulation._last()
            x, v = frame.x.copy(), frame.v.copy()
            yield frame
            if simulation.stopped:
                return
            for what, before, after in (("position", x, frame.x), ("velocity", v, frame.v)):
                if simulation.agreed(not np.array_equal(before, after)):
                    simulation.set(what, after)
            if not simulation.next_frame():
                return
