#!/usr/bin/env python3
"""ASE on networks: its own differences of energies, its optimiser beside statics, its dynamics beside velocity Verlet, its phonons beside closed forms."""
import pathlib
import sys
import tempfile
import warnings

try:
    import ase
except ImportError:
    print("ASE is absent: apt install python3-ase")
    sys.exit(77)

HERE = pathlib.Path(__file__).resolve().parent
PROGRAM = pathlib.Path(sys.argv[sys.argv.index("--program") + 1]).resolve()
sys.path[:0] = [str(PROGRAM.parent / "python"), str(HERE)]

import numpy as np  # noqa: E402
from ase import Atoms, units  # noqa: E402
from ase.build import bulk, graphene  # noqa: E402
from ase.calculators.calculator import PropertyNotImplementedError  # noqa: E402
from ase.constraints import FixAtoms, FixBondLength  # noqa: E402
from ase.md.verlet import VelocityVerlet  # noqa: E402
from ase.optimize import BFGS  # noqa: E402
from ase.phonons import Phonons  # noqa: E402

import backspring as bs  # noqa: E402
from backspring.ase import Backspring, lattice_of  # noqa: E402
from cases import cell, sheet  # noqa: E402


def atoms_of(net):
    """Atoms at the places of a network."""
    positions = np.zeros((len(net), 3))
    positions[:, : net.dim] = net.x
    box, periodic = np.diag([9.0, 9.0, 4.0]), np.zeros(3, bool)
    if net.box is not None:
        box[: net.dim, : net.dim], periodic[: net.dim] = net.box, net.periodic
    return Atoms(f"Ar{len(net)}", positions=positions, cell=box, pbc=periodic, masses=net.mass)


def differences():
    """Forces and stresses are the differences of energies, in two dimensions and three, in boxes that are skewed."""
    crystal = bulk("Ar", "fcc", a=5.2, cubic=True) * (1, 2, 1)
    crystal.set_cell(crystal.cell.array @ [[1.02, 0.05, 0], [0, 0.97, 0.03], [0, 0, 1.01]], scale_atoms=True)
    net = lattice_of(crystal, cutoff=4.2, stiffness=0.7, rest_length=3.6)
    crystal.rattle(0.1, seed=2)
    crystal.calc = Backspring(net)
    flat = atoms_of(bs.Lattice(**cell()))
    flat.calc = Backspring(bs.Lattice(**cell()))
    for atoms, components in ((crystal, range(6)), (flat, (0, 1, 5))):
        forces, stress = atoms.get_forces().copy(), atoms.get_stress().copy()
        d = 3 if atoms is crystal else 2
        assert abs(forces - atoms.calc.calculate_numerical_forces(atoms, 1e-4))[:, :d].max() < 1e-7 * (1 + abs(forces).max())
        numeric = atoms.calc.calculate_numerical_stress(atoms, 1e-5)
        assert abs(stress - numeric)[list(components)].max() < 1e-6 * abs(stress).max(), (stress, numeric)
        assert abs(forces.sum(axis=0)).max() < 1e-12 * abs(forces).sum()


def sheets():
    """Graphene whose cell has no third edge, as ASE builds it; atoms that are periodic otherwise than the network are refused."""
    atoms = graphene(size=(2, 2, 1))
    atoms.calc = Backspring(lattice_of(atoms, 1.6, 0.7, rest_length=1.3))
    atoms.rattle(0.05, seed=1)
    assert abs(atoms.get_forces() - atoms.calc.calculate_numerical_forces(atoms, 1e-4)).max() < 1e-8
    atoms.set_pbc(False)
    try:
        atoms.get_potential_energy()
    except bs.InputError as error:
        assert "set_pbc" in str(error), error
    else:
        raise AssertionError("atoms without a box were computed in one")


def taken():
    """A network has the velocities of its Atoms and what FixAtoms holds, unless they are given; of other constraints it is warned."""
    atoms = bulk("Ar", "fcc", a=5.2, cubic=True) * (2, 1, 1)
    plain = lattice_of(atoms, 4.2)
    assert not plain.velocity.any() and not plain.fixed.any()
    v = np.random.default_rng(2).normal(size=(len(atoms), 3))
    atoms.set_velocities(v)
    atoms.set_constraint([FixAtoms([0, 3]), FixAtoms(mask=np.arange(len(atoms)) == 5)])
    net = lattice_of(atoms, 4.2)
    assert np.flatnonzero(net.fixed).tolist() == [0, 3, 5] and np.allclose(net.velocity, v, rtol=1e-13)
    own = lattice_of(atoms, 4.2, velocity=2 * v, fixed=[1])
    assert np.flatnonzero(own.fixed).tolist() == [1] and np.array_equal(own.velocity, 2 * v)
    atoms.set_constraint([FixAtoms([0]), FixBondLength(1, 2)])
    for more, words in (({}, ["FixBondLength"]), (dict(fixed=[0]), [])):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            assert np.flatnonzero(lattice_of(atoms, 4.2, **more).fixed).tolist() == [0]
        assert len(said) == len(words) and all(word in str(one.message) and one.filename == __file__ for word, one in zip(words, said)), [str(one.message) for one in said]


def places_alone():
    """Negative rows of FixAtoms count from the end; energies are to be had where a cell has no volume, stresses where it has one; what depends on the past is
    refused."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1.1, 0]])
    atoms = Atoms("H4", positions=square)
    atoms.set_constraint([FixAtoms(indices=[-1]), FixAtoms(indices=[0, -3])])
    assert np.flatnonzero(lattice_of(atoms, 1.2).fixed).tolist() == [0, 1, 3]
    sides = [[0, 1], [0, 2], [1, 3], [2, 3]]
    for edges, periodic in ((np.diag([2.1, 2.3]), (True, True)), (np.diag([2.1, 0]), (True, False))):
        net = bs.Lattice(square[:, :2], sides, box=edges, periodic=periodic, rest_length=0.9)
        with bs.Simulation(net, dt=1.0) as simulation:
            energy, forces = float(simulation.observables["elastic_energy"]), simulation.forces
        for height in (0.0, 4.0):
            cell = np.zeros((3, 3))
            cell[:2, :2], cell[2, 2] = edges, height
            atoms = Atoms("H4", positions=square, cell=cell, pbc=(*periodic, False))
            atoms.calc = Backspring(net)
            assert abs(atoms.get_potential_energy() - energy) < 1e-12 and np.allclose(atoms.get_forces()[:, :2], forces, atol=1e-12)
            if np.linalg.det(cell):
                assert atoms.get_stress().any()
                continue
            try:
                atoms.get_stress()
            except PropertyNotImplementedError:
                continue
            raise AssertionError("a stress without a volume")
    pair = bs.Lattice(square[:2], [[0, 1]], stiffness=10.0, rest_length=1.0)
    plastic = pair.replace(law="plastic", spring_columns={"yield_force": [0.5], "hardening": [0.0]})
    for net, options in ((plastic, {}), (pair, dict(bs_spring_law="maxwell", bs_spring_relaxation_time=1.0))):
        atoms = Atoms("H2", positions=square[:2])
        atoms.calc = Backspring(net, **options)
        for _ in range(2):
            try:
                atoms.get_potential_energy()
            except bs.InputError as error:
                assert "law" in str(error) and "hooke" in str(error), error
            else:
                raise AssertionError("an energy that depends on the past")


def wrapped():
    """Atoms that are put back into the box pull as before; those that move by less than half a box stay where they are, however skew its edges are."""
    net = bs.Lattice(**cell())
    atoms = atoms_of(net)
    atoms.calc = Backspring(net)
    atoms.positions[3, :2] += 4.0
    before = atoms.get_forces().copy()
    atoms.wrap()
    assert abs(atoms.get_forces() - before).max() < 1e-10 * abs(before).max()
    skew = net.replace(box=[[5.0, 0], [15, 5]], shift=net.shift @ [[1, 0], [-3, 1]])  # the same images by other edges
    forces = []
    for one in (net, skew):
        atoms = atoms_of(one)
        atoms.calc = Backspring(one)
        atoms.positions[3, 1] += 1.0
        forces.append(atoms.get_forces())
    assert abs(forces[1] - forces[0]).max() < 1e-12 * abs(forces[0]).max(), abs(forces[1] - forces[0]).max()


def optimiser():
    """BFGS comes to the equilibrium of statics."""
    net = bs.Lattice(**sheet())
    atoms = atoms_of(net)
    atoms.set_constraint(FixAtoms(mask=net.fixed))
    atoms.calc = Backspring(net, bs_gravity=(0, -9.81))
    BFGS(atoms, logfile=None).run(fmax=1e-7, steps=2000)
    eq = bs.statics(net, bs_gravity=(0, -9.81))
    assert abs(atoms.positions[:, :2] - eq.x).max() < 1e-7, abs(atoms.positions[:, :2] - eq.x).max()
    held = (9.81 * net.mass * net.x[:, 1])[net.fixed].sum()  # that of fixed particles, which statics leaves out
    assert abs(atoms.get_potential_energy() - held - eq.observables["potential_energy"]) < 1e-8


def dynamics():
    """ASE's velocity Verlet is the program's."""
    net = bs.Lattice(**{**sheet(), "damping": 0.0, "fixed": ()})
    atoms = atoms_of(net)
    atoms.calc = Backspring(net)
    h = 2e-3
    VelocityVerlet(atoms, timestep=h, logfile=None).run(50)  # in the network's own units of time
    simulation = bs.Simulation(net, ts_type="verlet", dt=h)
    simulation.step(50)
    assert abs(atoms.positions[:, :2] - simulation.x).max() < 1e-11 and abs(simulation.x - net.x).max() > 1e-3


def phonons():
    """Simple cubic, springs between neighbours: along x, omega^2 = (4 k/m) sin^2(q a/2), and 0 across."""
    a, k = 3.0, 2.0
    atoms = Atoms("Ar", cell=[a, a, a], pbc=True)
    supercell = atoms * (4, 4, 4)
    with tempfile.TemporaryDirectory() as folder:
        found = Phonons(atoms, Backspring(lattice_of(supercell, cutoff=1.1 * a, stiffness=k)), supercell=(4, 4, 4), delta=0.001, name=f"{folder}/phonon")
        found.run()
        found.read(acoustic=True)
        for q in (0.125, 0.25, 0.5):
            omega = found.band_structure([[q, 0, 0]], verbose=False)[0] / units._hbar * units._e * 1e-10 * np.sqrt(units._amu / units._e)
            expected = np.sqrt(4 * k / atoms.get_masses()[0]) * np.sin(np.pi * q)
            assert abs(omega[-1] - expected) < 1e-5 * expected and abs(omega[:2]).max() < 1e-2 * expected, (omega, expected)


def main():
    for part in (differences, sheets, taken, places_alone, wrapped, optimiser, dynamics, phonons):
        if "--filter" not in sys.argv or sys.argv[sys.argv.index("--filter") + 1] in part.__name__:
            part()
            print(f"{part.__name__}: ok", flush=True)
    print(f"ASE {ase.__version__}: ok")


if __name__ == "__main__":
    main()
