"""Lattices of springs from meshes, LAMMPS data and PDB files, as backspring reads them (meshes/README.md)."""
import sys

import h5py
import numpy as np

from backspring_io import RunError
from run_data import counted
from exports import write_atomically
from finite import check_lattice
from selection import select


MOST_NEAR = 20_000_000  # pairs of points for --merge, whose memory they take


def need_meshio():
    try:
        import meshio  # noqa: F401
    except ImportError:
        raise RunError("no meshio in this Python; install with: sudo apt-get install python3-meshio") from None


class Lattice:
    """Positions (N, 3), pairs (M, 2), and what the file says of the rest, None where it is silent."""
    position = pairs = velocity = mass = ids = fixed = stiffness = rest_length = damping = units = angles = box = shift = None
    hinges = anchors = laws = dim = damping_law = length_unit = None
    spring_columns, particle_columns, groups = {}, {}, {}
    spring_groups = {}  # {name: rows of springs}
    notes, merge_hint = (), "; use --merge 1e-6"


def from_lammps(args):
    from lammps_data import read_lammps
    if args.merge:
        raise RunError("--merge is for meshes; atoms keep their identity")
    wanted = [name for name in ("stiffness", "rest_length") if getattr(args, name) is None]
    data, out = read_lammps(args.input, args.atom_style, args.units, args.boundary, wanted), Lattice()
    for name in ("notes", "position", "pairs", "velocity", "mass", "ids", "stiffness", "rest_length", "units", "angles", "box", "shift"):
        setattr(out, name, getattr(data, name))
    out.merge_hint = ": their bond has no direction"
    if args.si:
        _in_si(args.input, out)
    if out.stiffness is not None and args.spring_law == "strain":
        rest = out.rest_length if args.rest_length is None else np.full(len(out.pairs), args.rest_length)
        out.stiffness = out.stiffness * np.where(rest > 0, rest, 1.0)  # K/L [N/m] in the file, K [N] in the lattice
    return out


def from_protein(args):
    import protein
    if args.merge or args.units or args.si:
        raise RunError("--merge, --units and --si are not for PDB files, which are in angstrom")
    chains = None if args.chain is None else args.chain.split(",")
    read = protein.read_pdb(args.input, chains, 1 if args.model is None else args.model, args.altloc)
    out = Lattice()
    out.position, out.pairs, out.notes = read.position, protein.network(read.position, 15.0 if args.cutoff is None else args.cutoff), read.notes
    out.merge_hint, out.length_unit = "", "Angstrom"
    if all(word.isdigit() for word in read.serial) and len(set(read.serial)) == len(read.serial):
        out.ids = np.array([int(word) for word in read.serial], np.int64)
    ends = out.position[out.pairs]
    out.rest_length = np.sqrt(((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1))
    if len(out.pairs) and out.rest_length.min() == 0:
        a, b = (f"{read.serial[k]} (chain {read.chain[k]}, residue {read.residue[k]})" for k in out.pairs[out.rest_length.argmin()])
        raise RunError(f"{args.input}: atoms {a} and {b} lie at one place: their spring would have no direction; leave one of them out (--chain, --altloc)")
    out.stiffness, out.mass = np.ones(len(out.pairs)), np.ones(len(out.position))
    args.dim = args.dim or 3
    return out


def _in_si(path, lattice):
    import lammps_units
    if lattice.units is None:
        raise RunError(f"{path}: does not say its units, so they cannot be converted to SI; add --units")
    mass, length, time = lammps_units.to_si(lattice.units)
    for name, unit in (("position", length), ("velocity", length / time), ("mass", mass), ("stiffness", mass / time ** 2),
                       ("rest_length", length)):
        if getattr(lattice, name) is not None:
            setattr(lattice, name, getattr(lattice, name) * unit)
    if lattice.box:
        lattice.box = (lattice.box[0] * length, lattice.box[1])
    if lattice.angles:
        lattice.angles["stiffness"] *= mass * length ** 2 / time ** 2
    lattice.units = "si"


def from_mesh(args):
    need_meshio()
    from mesh_edges import read_mesh
    if args.units or args.si:
        raise RunError("--units and --si are for LAMMPS data; a mesh is read as it is")
    points, edges, said, groups, notes = read_mesh(args.input)
    if said and args.merge:
        raise RunError(f"{args.input}: is a lattice already; --merge is for meshes")
    out = Lattice()
    for name, values in said.items():
        setattr(out, name, values)
    if said and "laws" not in said and args.spring_law is None:
        notes.append("says no spring law, hooke is assumed (--spring_law names another)")
    out.position, out.pairs = points, edges
    if not said:
        out.position, out.pairs, row = tidy(points, edges, args.merge, args.keep_unused)
        out.groups = {name: np.setdiff1d(row[of.points], [-1]) for name, of in groups.items()}
        out.spring_groups = {name: rows for name, of in groups.items() if len(rows := _rows_of(out.pairs, row[of.pairs]))}
        if len(out.position) < len(points):
            notes.append(f"{counted(len(points) - len(out.position), 'point')} merged or without springs left out")
        empty = [name for name, rows in out.groups.items() if not len(rows)]
        if empty:
            notes.append(f"groups without a particle left out: {', '.join(empty)}")
            out.groups = {name: rows for name, rows in out.groups.items() if len(rows)}
    out.notes = notes
    return out


def tidy(position, pairs, merge, keep_unused):
    """Merges points not farther apart than `merge`, drops springs that became points or doubles, and points without springs.
    Returns positions, pairs, and the new row (N,) of every point, -1 of those that are dropped."""
    row = first = np.arange(len(position))
    if merge > 0:
        first, row = joined(position, merge)
        pairs = np.sort(row[pairs], axis=1)
        pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    if not keep_unused:
        used = np.zeros(len(first), dtype=bool)
        used[pairs.ravel()] = True
        place = np.where(used, np.cumsum(used) - 1, -1)
        first, row, pairs = first[used], place[row], place[pairs]
    return position[first], pairs, row


def joined(position, reach):
    """Of points not farther apart than `reach`, directly or by way of others, one: the rows of the first of each such set, and the place (N,) among them of every point's set."""
    try:
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree
    except ImportError:
        raise RunError("no scipy in this Python, which --merge needs; install with: sudo apt-get install python3-scipy") from None
    places, place = np.unique(position, axis=0, return_inverse=True)  # each place once: many points at one have many pairs
    scale = -np.frexp(np.abs(places).max(initial=0.0))[1]  # by a power of two, which rounds nothing: squares of large coordinates overflow
    tree, reach = cKDTree(np.ldexp(places, scale)), np.ldexp(reach, scale)
    some = tree.data[::max(1, len(places) // 1000)]  # to count all would take minutes
    if tree.query_ball_point(some, reach, return_length=True).mean() * len(places) > max(MOST_NEAR, 100 * len(places)):
        raise RunError(f"--merge {np.ldexp(reach, -scale):g}: points have far too many others so near; write a distance that is shorter than the springs")
    near = tree.query_pairs(reach, output_type="ndarray")
    part = connected_components(coo_matrix((np.ones(len(near), bool), near.T), shape=(len(places),) * 2), directed=False)[1]
    _, first, row = np.unique(part[place.reshape(-1)], return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[row.reshape(-1)]


def _rows_of(pairs, wanted):
    """Rows of the sorted unique `pairs` (M, 2) that are among `wanted` (K, 2), whose ends stand in any order."""
    size = max(int(pairs.max(initial=0)), int(wanted.max(initial=0))) + 1
    low, high = np.sort(wanted, axis=1).T
    return np.flatnonzero(np.isin(pairs @ [size, 1], low * size + high))


def reduce_dimension(lattice, dim, path):
    """d as asked, else 2 where all z are equal and nothing moves along z, else 3. Components dropped must not vary."""
    position, velocity = lattice.position, lattice.velocity
    size = np.ptp(position, axis=0)
    flat = size <= 1e-12 * max(size.max(), 1e-300)
    still = np.ones(3, dtype=bool) if velocity is None else ~velocity.any(axis=0)
    if dim is None:
        dim = 2 if flat[2] and still[2] else 3
    for k in range(dim, 3):
        if not flat[k]:
            raise RunError(f"{path}: --dim {dim} would drop {'xyz'[k]}, which varies; project the mesh first")
        if not still[k]:
            raise RunError(f"{path}: --dim {dim} would drop velocities along {'xyz'[k]}; write --dim {k + 1}")
    if lattice.box:
        edges, periodic = lattice.box
        if edges[dim:, :dim].any():
            raise RunError(f"{path}: --dim {dim} would drop an edge of the box that leans along {'xyz'[:dim]}; write --dim 3")
        lattice.box, lattice.shift = (edges[:dim, :dim], periodic[:dim]), None if lattice.shift is None else lattice.shift[:, :dim]
    lattice.position = position[:, :dim]
    lattice.velocity = None if velocity is None else velocity[:, :dim]


def lengths(lattice):
    """Lengths (M,) of the springs as they lie."""
    across = 0 if lattice.shift is None else lattice.shift @ lattice.box[0]
    return np.sqrt(((lattice.position[lattice.pairs[:, 1]] - lattice.position[lattice.pairs[:, 0]] + across) ** 2).sum(axis=1))


def check_springs(path, lattice):
    """A spring to itself or of no length has no direction."""
    pairs, rest_length = lattice.pairs, lattice.rest_length
    names = ids_of(lattice)
    itself = np.flatnonzero(pairs[:, 0] == pairs[:, 1])
    if len(itself) and lattice.shift is None:
        raise RunError(f"{path}: spring {itself[0]} joins point {names[pairs[itself[0], 0]]} to itself")
    none = np.flatnonzero((lengths(lattice) == 0) & (True if rest_length is None else rest_length > 0))
    if len(none):
        a, b = names[pairs[none[0]]]
        raise RunError(f"{path}: points {a} and {b} lie at one place{lattice.merge_hint}")


def ids_of(lattice):
    """The particles' own numbers (N,), else their rows."""
    return np.arange(len(lattice.position)) if lattice.ids is None else lattice.ids


def write_lattice(path, lattice, spring_law=None, damping_law=None):
    """The lattice as backspring reads it. A law that is given is that of all springs, else each has its own, or is hooke and axial."""
    held = lattice.fixed
    with h5py.File(path, "w") as f:
        f["particles/position"], f["particles/mass"] = lattice.position, lattice.mass
        f["springs/pairs"], f["springs/stiffness"] = lattice.pairs.astype(np.int64), lattice.stiffness
        for name, data in (("particles/velocity", lattice.velocity), ("particles/id", lattice.ids), ("springs/rest_length", lattice.rest_length),
                           ("springs/damping", lattice.damping),
                           ("particles/fixed", held.astype(np.uint8) if held is not None and held.any() else None)):
            if data is not None:
                f[name] = data
        if lattice.box:
            edges, periodic = lattice.box
            f["box/edges"] = edges
            if lattice.shift is not None:
                f["springs/shift"] = lattice.shift.astype(np.int64)
            f["box"].attrs["dimension"], f["box"].attrs["boundary"] = len(edges), ["periodic" if one else "none" for one in periodic]
        for group, table in (("angles", lattice.angles), ("hinges", lattice.hinges), ("anchors", lattice.anchors), ("groups", lattice.groups), ("springs", lattice.spring_columns),
                             ("particles", lattice.particle_columns)):
            for name, data in (table or {}).items():
                f[f"{group}/{name}"] = data
        laws = sorted({str(law) for law in lattice.laws}) if lattice.laws is not None and spring_law is None else [spring_law or "hooke"]
        if len(laws) > 1:
            f["springs/law"], f.attrs["spring_laws"] = np.searchsorted(laws, lattice.laws), laws
        else:
            f.attrs["spring_law"] = (laws or ["hooke"])[0]
        if lattice.length_unit is not None:
            f.attrs["length_unit"] = lattice.length_unit  # for people: pictures of what is made of the lattice find it
        f.attrs["damping_law"] = damping_law or lattice.damping_law or "axial"


def to_lattice(args, kind):
    """Reads the input, `kind` of lammps, protein or mesh, puts in what the options say, and writes the lattice; returns a line about it."""
    lattice = {"lammps": from_lammps, "protein": from_protein, "mesh": from_mesh}[kind](args)
    count, springs = len(lattice.position), len(lattice.pairs)
    for name, size in (("stiffness", springs), ("damping", springs), ("rest_length", springs), ("mass", count)):
        if getattr(args, name) is not None:
            setattr(lattice, name, np.full(size, getattr(args, name)))
    if args.total_mass is not None:
        lattice.mass = np.full(count, args.total_mass / count)
    reduce_dimension(lattice, args.dim or lattice.dim, args.input)
    if kind == "lammps" and lattice.angles and lattice.position.shape[1] == 2:
        import lammps_angles
        lammps_angles.in_the_plane(lattice.position, lattice.angles, lattice.box)
    import bars
    bars.of_bars(args, lattice)
    if lattice.stiffness is None and springs:
        raise RunError(f"{args.input}: says nothing of stiffness; add --stiffness "
                       + ("K [N]" if args.spring_law == "strain" else "k [N/m]") + ", or --youngs E [Pa] and --area A [m^2]")
    if lattice.mass is None:
        raise RunError(f"{args.input}: says nothing of mass; add --mass m [kg] of a particle, --total_mass M [kg], or --density rho [kg/m^3] and --area A [m^2]")
    check_lattice(args.input, lattice)
    check_springs(args.input, lattice)
    held = np.zeros(count, bool) if lattice.fixed is None else lattice.fixed != 0
    lattice.fixed = held | select(args.fixed, lattice.position, ids_of(lattice), lattice.groups, "--fixed")
    if lattice.units:
        import lammps_units
        lattice.length_unit = lammps_units.length_of(lattice.units)
    lattice.stiffness = np.zeros(0) if lattice.stiffness is None else lattice.stiffness
    write_atomically(args.output, lambda part: write_lattice(part, lattice, args.spring_law, args.damping_law))
    for note in lattice.notes:
        print(f"convert.py: {args.input}: {note}", file=sys.stderr)
    angles = ", " + counted(len(lattice.angles["triples"]), "angle spring") if lattice.angles else ""
    said = f"{counted(count, 'particle')} ({int(lattice.fixed.sum())} fixed), {counted(springs, 'spring')}{angles}, d = {lattice.position.shape[1]}"
    if lattice.groups:
        said += f", group{'s' if len(lattice.groups) > 1 else ''} {', '.join(lattice.groups)}"
    if lattice.units:
        said += f", in {lammps_units.named(lattice.units)}"
    return said
