"""Motions as iterators over their frames."""

from __future__ import annotations

from typing import Dict, Generator, Iterator, Optional, Union

from ._library import ends_first, on_all, world
from .arguments import array_of
from .errors import Stopped
from .frames import Frame
from .kinds import Comm, GivenForces, Loads, Option, Settings, Shared
from .lattice import Lattice
from .motion import Simulation
from .options import joined, options_of, settings_of
from .progress import Progress
from .results import Equilibrium
from .watching import Observe


def run(net: Union[Lattice, Equilibrium], *, until: float, dt: Optional[float] = None, every: Optional[float] = None, loads: Optional[Loads] = None,
        total: Shared = False, forces: Optional[GivenForces] = None, observe: Optional[Observe] = None, stop: Optional[Observe] = None, progress: bool = False,
        comm: Comm = None, **options: Option) -> Iterator[Frame]:
    """Frames of a motion from t = 0 to `until` [s], the first of them the start, then one every `every` [s] (None: after every step); steps end at them.

        for frame in bs.run(net, ts_type="cn", dt=1e-3, until=2.0, every=0.1):
            frame.v *= 0.99

    observe(t, frame) is called after every step; stop(t, frame) likewise: where it returns True the frame of this moment is the last. progress: a bar of
    tqdm. dt [s] and the rest as of Simulation; options of the program by their names: ts_max_steps=100 ends it after so many steps, with a warning. Raises
    InputError, and ConvergenceError whose state is the last good frame. On several ranks all leave the loop at the same frame; where some leave it alone, by
    an exception or break, Stopped is raised on the others as soon as they ask for the next frame.
    """
    times: Dict[str, Option] = {}

    def checked() -> Settings:
        times["ts_max_time"] = float(array_of("until", until, ()))
        times["bs_output_interval"] = None if every is None else float(array_of("every", every, (), positive=True))
        return joined([], settings_of(times) + options_of(run, options))

    on_all(comm, checked)
    simulation = Simulation(net, dt=dt, loads=loads, total=total, forces=forces, observe=observe, stop=stop, comm=comm,
                            **{**options, **{name: value for name, value in times.items() if value is not None}})
    simulation._bar = Progress(progress, comm, simulation.t, times["ts_max_time"], "t / s") if progress else None
    simulation._attach()
    frames = _frames(simulation)
    ends_first(frames, simulation._number)
    return frames


def _frames(simulation: Simulation) -> Generator[Frame, None, None]:
    with simulation:
        more = True
        while more:
            frame = simulation._last(changeable=True)
            stays = False
            try:
                yield frame
                stays = True
            finally:
                _together(simulation, stays)
            if simulation.stopped:
                return
            for what in ("position", "velocity"):
                if simulation.agreed(frame._changed(what)):
                    simulation._put(what, frame._own(what), whole=True, same=False)  # of each rank its own rows
            more = simulation.next_frame()


def _together(simulation: Simulation, stays: bool) -> None:
    """Collective, whenever a rank comes back for the next frame or has left the loop. By the session's own communicator: the caller's may be in use."""
    session = simulation._session
    if world(simulation._comm).size > 1 and session.on_some_rank(not stays) and session.on_some_rank(stays) and stays:
        raise Stopped("another rank left the loop over run(), by an exception, break or return: leave it on all ranks, or say stop=")
