"""Networks that the program or its converter reads, and those that the program generates."""

from __future__ import annotations

import contextlib
import io
import os
import pathlib
import tempfile
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Union

import numpy as np

from ._library import on_all, require_same, started, world
from .errors import InputError, check, pass_on
from .kinds import Comm, Option, Settings
from .lattice import INTERACTIONS, Lattice, Path
from .options import joined, settings_of
from .trajectories import tool

if TYPE_CHECKING:
    from ._core import LatticeArrays

OWN = (".h5", ".hdf5", ".h5md", ".xsp")  # endings of what the program reads itself


def _lattice_of(a: LatticeArrays) -> Lattice:
    """Of what the extension has read."""
    n, d, s = len(a.mass), a.dim, len(a.stiffness)
    more: Dict[str, Any] = {}
    if any(a.box[0]):
        more.update(box=np.reshape(a.box[1], (d, d)), periodic=a.box[0], shift=a.shift.reshape(s, d) if a.shift.size else None)
    particle, point, stiffness, rest_length, damping = a.anchors
    if particle.size:
        more["anchors"] = dict(particle=particle, point=point.reshape(-1, d), stiffness=stiffness, rest_length=rest_length, damping=damping)
    for kind, (ends, parameter, shift, limits) in a.interactions.items():
        name, count = INTERACTIONS[kind]
        if ends.size:
            more[kind] = {name: ends.reshape(-1, count), "stiffness": parameter[::2], "rest_angle": parameter[1::2], "shift": shift.reshape(len(ends) // count, -1) if shift.size else None, **limits}
    return Lattice(a.position.reshape(n, d), a.springs.reshape(s, 2), stiffness=a.stiffness, rest_length=a.rest_length, damping=a.damping,
                   area=a.area if a.area.size else None, mass=a.mass, velocity=a.velocity.reshape(n, d), fixed=a.fixed.astype(bool),
                   groups={name: member.astype(bool) for name, member in a.groups.items()}, law=[a.laws[k] for k in a.law] if a.law.size else a.spring_law or "hooke",
                   damping_law=a.damping_law or "axial", spring_columns=a.spring_columns, breaking=a.break_columns, parallel=True,
                   particle_columns={name: v.reshape(n, -1) if v.size > n else v for name, v in a.particle_columns.items()},
                   options={name[1:]: text for name, text in a.implied_options}, **more)


def _read(settings: Settings, comm: Comm) -> Lattice:
    core, handle = started(comm)
    require_same(comm, {name[1:]: value for name, value in settings})
    error, arrays, told = core.read_lattice(handle, settings)
    pass_on(told)
    check(error)
    return _lattice_of(arrays)


def _words(arguments: Dict[str, Option]) -> List[str]:
    """Arguments of the converter."""
    words: List[str] = []
    for name, value in arguments.items():
        if value is None or value is False:
            continue
        words.append(f"--{name}" if value is True else f"--{name}={','.join(map(str, value)) if isinstance(value, (list, tuple)) else value}")
    return words


def _converted(path: Path, arguments: Dict[str, Option], settings: Settings) -> Lattice:
    """By this process alone."""
    from mpi4py import MPI

    convert, wrong = tool("convert"), tool("open_hdf5").RunError
    with tempfile.TemporaryDirectory() as folder:
        lattice, said = os.path.join(folder, pathlib.Path(path).stem + ".h5"), io.StringIO()
        try:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
                convert.main([str(path), "-o", lattice, *_words(arguments)])
        except (wrong, OSError) as why:
            raise InputError(str(why)) from None
        except SystemExit:
            raise InputError(f"{path}: {said.getvalue().rsplit('error: ', 1)[-1].strip()}: give arguments of convert.py, whose --help lists them") from None
        return _read([("-bs_lattice_file", lattice)] + settings, MPI.COMM_SELF)


def read(path: Path, *, comm: Comm = None, **options: Option) -> Lattice:
    """The network of a file: one that the program reads (.h5, .xsp, a trajectory), with what its options change of it (bs_group_top="ymax"); or a mesh (.msh,
    .ply, .vtu and others), LAMMPS data or a PDB file, by the arguments of convert.py beside them: stiffness=100, total_mass=0.5, fixed="zmin", cutoff=8.0.
    Lengths and all else in the units of the file. Collective on `comm`."""
    arguments = {name: value for name, value in options.items() if not name.startswith("bs_")}
    settings = settings_of({name: value for name, value in options.items() if name.startswith("bs_")})
    if pathlib.Path(path).suffix.lower() not in OWN:
        started(comm)
        require_same(comm, {"path": str(path), **arguments, **{name[1:]: value for name, value in settings}})
        found: Optional[Lattice] = on_all(comm, lambda: _converted(path, arguments, settings) if world(comm).rank == 0 else None)
        lattice: Lattice = world(comm).bcast(found)
        return lattice
    if arguments:
        raise InputError(f"{next(iter(arguments))}: is for meshes and other files that are converted; {path} is read as it is: change the network by replace(), or give options bs_...")
    return _read([("-bs_lattice_file", str(path))] + settings, comm)


def generate(kind: str, size: Union[int, Sequence[int]], *, comm: Comm = None, **options: Option) -> Lattice:
    """A network by the program's generators: generate("triangular", (20, 10), dim=2, fixed="ymin", seed=1). Keywords are the options bs_lattice_NAME, those
    that begin with bs_ other options of the program. size: particles, or cells,
    along the axes; spacing=1.0: distance between neighbours [m]. Collective on `comm`."""
    named = {name if name.startswith("bs_") else "bs_lattice_" + name: value for name, value in options.items()}
    return _read(joined([], settings_of({"bs_lattice_type": kind, "bs_lattice_size": size}) + settings_of(named)), comm)
