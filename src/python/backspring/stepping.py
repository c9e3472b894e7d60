"""Motions as iterators over their frames."""

from __future__ import annotations

from typing import Dict, Iterator, Optional, Union

import numpy as np

from ._library import on_all, world
from .arguments import array_of
from .errors import pass_on
from .frames import Frame
from .kinds import Comm, GivenForces, Loads, Option, Settings, Shared
from .lattice import Lattice
from .motion import Observe, Simulation
from .options import joined, settings_of, told
from .progress import Progress
from .results import Equilibrium


def run(net: Union[Lattice, Equilibrium], *, until: float, dt: Optional[float] = None, every: Optional[float] = None, loads: Optional[Loads] = None,
        total: Shared = False, forces: Optional[GivenForces] = None, observe: Optional[Observe] = None, stop: Optional[Observe] = None, progress: bool = False,
        comm: Comm = None, **options: Option) -> Iterator[Frame]:
    """Frames of a motion from t = 0 to `until` [s], the first of them the start, then one every `every` [s] (None: after every step); steps end at them.

        for frame in bs.run(net, ts_type="cn", dt=1e-3, until=2.0, every=0.1):
            frame.v *= 0.99

    observe(t, frame) is called after every step; stop(t, frame) likewise: where it returns True the frame of this moment is the last. progress: a bar of
    tqdm. dt [s] and the rest as of Simulation; options of the program by their names: ts_max_steps=100 ends it after so many steps, with a warning. Raises
    InputError, and ConvergenceError whose state is the last good frame.
    """
    times: Dict[str, Option] = {}

    def checked() -> Settings:
        times["ts_max_time"] = float(array_of("until", until, ()))
        times["bs_output_interval"] = None if every is None else float(array_of("every", every, (), positive=True))
        return joined([], settings_of(times) + settings_of(options))

    on_all(comm, checked)
    simulation = Simulation(net, dt=dt, loads=loads, total=total, forces=forces, observe=observe, stop=stop, comm=comm,
                            **{**options, **{name: value for name, value in times.items() if value is not None}})
    most = told("-ts_max_steps", simulation._settings)
    simulation._most = int(most) if most and most.isdigit() else None
    simulation._bar = Progress(progress, comm, simulation.t, times["ts_max_time"], "t / s") if progress else None
    simulation._attach()
    return _frames(simulation, times["ts_max_time"])


def _frames(simulation: Simulation, end: float) -> Iterator[Frame]:
    with simulation:
        while True:
            frame = simulation._last()
            x, v = frame.x.copy(), frame.v.copy()
            yield frame
            if simulation.stopped:
                return
            for what, before, after in (("position", x, frame.x), ("velocity", v, frame.v)):
                if simulation.agreed(not np.array_equal(before, after)):
                    simulation._put(what, after, whole=True, same=False)  # of each rank its own rows
            if simulation._most is not None and simulation.steps >= simulation._most and simulation.t < end:
                if world(simulation._comm).rank == 0:
                    pass_on([f"the run ended after {simulation.steps} steps by ts_max_steps, at t = {simulation.t:.10g} of {end:.10g}: give more of them"])
                return
            if not simulation.next_frame():
                return
