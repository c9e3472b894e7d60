"""ASE: a calculator on which its optimisers, dynamics and phonons run, and networks of its Atoms.

    from backspring.ase import Backspring, lattice_of
    net = lattice_of(atoms, cutoff=3.0, stiffness=5.0)
    atoms.calc = Backspring(net)

Units are those of the network: with ASE's own (Angstrom, eV, atomic mass units) stiffnesses are in eV/Angstrom^2.
"""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence

import numpy as np
from ase.calculators.calculator import Calculator, all_changes
from ase.constraints import FixAtoms
from ase.neighborlist import neighbor_list

from .errors import InputError, pass_on
from .kinds import Floats, Option
from .lattice import Lattice
from .motion import Simulation


def lattice_of(atoms: Any, cutoff: float, stiffness: Any = 1.0, rest_length: Any = None, **more: Any) -> Lattice:
    """The network of springs between all atoms nearer than `cutoff`, along the box of `atoms` as far as it is periodic; rest lengths by default as they
    are. The atoms' velocities go with them, and what FixAtoms holds is fixed; of other constraints, which a network has not, it is warned. `more`: arguments
    of Lattice, `velocity` and `fixed` in the place of the atoms' own."""
    i, j, shift = neighbor_list("ijS", atoms, cutoff)
    once = (i < j) | ((i == j) & (np.array([tuple(s) > (0, 0, 0) for s in shift], bool) if len(shift) else np.zeros(0, bool)))
    box: Dict[str, Any] = {}
    if atoms.pbc.any():
        box = dict(box=atoms.cell.complete().array, periodic=tuple(atoms.pbc), shift=shift[once])
    if atoms.has("momenta"):
        more.setdefault("velocity", atoms.get_velocities())
    if "fixed" not in more:
        more["fixed"] = np.zeros(len(atoms), bool)
        for one in atoms.constraints:
            if isinstance(one, FixAtoms):
                more["fixed"][one.get_indices()] = True  # negative ones count from the end
        pass_on(f"the constraint {type(one).__name__} of the atoms is not of the network: only FixAtoms is" for one in atoms.constraints if not isinstance(one, FixAtoms))
    net = Lattice(atoms.positions, np.stack([i[once], j[once]], axis=1), stiffness=stiffness, rest_length=rest_length, mass=atoms.get_masses(), parallel=True,
                  **box, **more)
    return net.replace(rest_length=net.lengths()) if rest_length is None else net


class Backspring(Calculator):  # type: ignore[misc]
    """Energies [of the network's springs and of the fields that options give], forces, and in periodic boxes, where the atoms' cell has a volume, stresses, by
    ASE's sign (positive: pulled) and order (xx, yy, zz, yz, xz, xy). Networks of one or two dimensions lie along x, or in the plane of x and y. What is fixed
    is a matter of ASE's constraints. Nothing breaks, and laws with history are refused: energies are those of places alone. `options`: fields and laws of
    the program, as of Simulation."""

    implemented_properties = ["energy", "forces", "stress"]

    def __init__(self, net: Lattice, **options: Option) -> None:
        super().__init__()
        self.net = net.with_images().replace(fixed=(), velocity=0.0)
        self.net = self.net.replace(rest_length=self.net.lengths() if net.rest_length is None else net.rest_length)
        self.options = options
        # reduced positions, which wrapping must not change
        self._last: Optional[Floats] = None if self.net.box is None else self.net.x @ np.linalg.inv(self.net._edges())
        self._box: Optional[Floats] = None
        self._simulation: Optional[Simulation] = None

    def _at(self, atoms: Any) -> Simulation:
        """The system with the box and the positions of `atoms`."""
        d = self.net.dim
        if len(atoms) != len(self.net):
            raise InputError(f"{len(atoms)} atoms for a network of {len(self.net)} particles")
        x = atoms.positions[:, :d]
        along = (False,) * d if self.net.box is None else self.net.periodic
        if tuple(atoms.pbc[:d]) != tuple(along):
            raise InputError(f"the atoms are periodic along {atoms.pbc[:d].tolist()}, the network along {list(along)}: give them the same (atoms.set_pbc)")
        box = None if self.net.box is None else atoms.cell.complete().array[:d, :d].copy()
        if box is not None:
            assert self._last is not None
            x = x + self.net._nearest_along(x - self._last @ box, box) @ box
            self._last = x @ np.linalg.inv(box)
        if self._simulation is None or (box is not None and (self._box is None or not np.array_equal(box, self._box))):
            if self._simulation:
                self._simulation.close()
            # no step is taken: the method costs nothing
            self._simulation = Simulation(self.net.replace(x=x, box=box), ts_type="verlet", dt=1.0, bs_advise=False, **self.options)
            if "dissipated_energy" in self._simulation.observables:
                self._simulation.close()
                self._simulation = None
                raise InputError("law: springs whose forces depend on what they have been through (plastic, maxwell) give atoms no energy of their places: take "
                                 "hooke or another law without history, or step the network by Simulation")
            self._box = box
        else:
            self._simulation.set("position", x)
        return self._simulation

    def calculate(self, atoms: Any = None, properties: Sequence[str] = ("energy",), system_changes: List[str] = all_changes) -> None:
        """ASE's: energy, forces (N, 3) and stress (6,) of `atoms` go into `results`."""
        super().calculate(atoms, properties, system_changes)
        simulation, d = self._at(atoms), self.net.dim
        observed = simulation.observables
        forces = np.zeros((len(atoms), 3))
        forces[:, :d] = simulation.forces
        self.results = {"energy": observed["potential_energy"], "free_energy": observed["potential_energy"], "forces": forces}
        if "stress" in observed and atoms.pbc.any() and atoms.cell.rank == 3:
            # of fewer dimensions per length or area: by the height of the cell beyond them
            height = atoms.get_volume() / abs(np.linalg.det(atoms.cell.array[:d, :d])) if d < 3 else 1.0
            self.results["stress"] = np.zeros(6)
            self.results["stress"][{1: [0], 2: [0, 1, 5], 3: [0, 1, 2, 3, 4, 5]}[d]] = np.atleast_1d(observed["stress"]) / height
