"""The box of a LAMMPS file: molecules put together again where its faces cut them, networks without ends left in it; boxes of trajectories as LAMMPS has them."""
import numpy as np

from backspring_io import RunError


def edges(header):
    """(3, 3): the box' edges a = (lx, 0, 0), b = (xy, ly, 0), c = (xz, yz, lz) as rows; 0 where the file names no bounds."""
    cell = np.zeros((3, 3))
    for k, axis in enumerate("xyz"):
        if axis in header:
            cell[k, k] = header[axis][1] - header[axis][0]
    cell[1, 0], cell[2, 0], cell[2, 1] = header.get("tilt", (0.0, 0.0, 0.0))
    return cell


def periods(text):
    """[bool] * 3 of "p,p,f"."""
    words = text.split(",")
    if len(words) != 3 or any(w not in ("p", "f", "s", "m") for w in words):
        raise RunError(f"--boundary {text}: write p (periodic) or f (not) of x, y and z, for example p,p,f")
    return [w == "p" for w in words]


def nearest(cell, difference, periodic):
    """Images (M, 3) by which the second end of each bond is nearest to its first, taken as LAMMPS does: along c, b, then a."""
    difference, images = difference.copy(), np.zeros(difference.shape, dtype=np.int64)
    for k in (2, 1, 0):
        if periodic[k] and cell[k, k] > 0:
            images[:, k] = -np.round(difference[:, k] / cell[k, k]).astype(np.int64)
            difference += images[:, k, None] * cell[k]
    return images


def unwrap(cell, position, images, pairs, periodic):
    """Positions (N, 3) outside of the box, the number of bonds that its faces cut, and None; or, where bonds join a molecule or network to its own image, the
    images (M, 3) of second ends that they join instead. `images` are the file's flags; along bonds, which LAMMPS takes between nearest images, they are set
    anew where the flags say otherwise and the molecule ends."""
    images = images.copy()
    placed = position + images @ cell
    steps = nearest(cell, placed[pairs[:, 1]] - placed[pairs[:, 0]], periodic)
    cut = np.flatnonzero(steps.any(axis=1))
    if not len(cut):
        return placed, 0, None
    shift = _walk(len(position), pairs, steps, pairs[cut, 0])
    if (shift[pairs[:, 1]] - shift[pairs[:, 0]] != steps).any():
        return placed, len(cut), steps
    return position + (images + shift) @ cell, len(cut), None


def _walk(count, pairs, steps, roots):
    """Images (N, 3) of the particles relative to the first of their molecule, step by step along bonds; only molecules of `roots`."""
    ends = np.concatenate([pairs, pairs[:, ::-1]])
    order = np.argsort(ends[:, 0], kind="stable")
    first = np.searchsorted(ends[order, 0], np.arange(count + 1)).tolist()
    other, step = ends[order, 1].tolist(), np.concatenate([steps, -steps])[order].tolist()
    shift = [None] * count
    for root in roots.tolist():
        if shift[root] is not None:
            continue
        shift[root], waiting = (0, 0, 0), [root]
        while waiting:
            at = waiting.pop()
            x, y, z = shift[at]
            for k in range(first[at], first[at + 1]):
                if shift[other[k]] is None:
                    shift[other[k]] = (x + step[k][0], y + step[k][1], z + step[k][2])
                    waiting.append(other[k])
    return np.array([s or (0, 0, 0) for s in shift], dtype=np.int64)


def triclinic(run):
    """Whether the edges of its box are not along the axes in some frame."""
    return any(run.periodic) and any(np.count_nonzero(e - np.diag(np.diag(e))) for e in (run.box_edges(row) for row in range(run.frames)))


class Frame:
    """A frame in the box that LAMMPS takes: its lower corner, edges (3, 3) as rows a = (lx, 0, 0), b = (xy, ly, 0), c = (xz, yz, lz) with tilts of half a
    length at most, which axes are periodic; positions (N, 3) in it, velocities (N, 3) or None, image flags (N, 3)."""
    low = cell = periodic = position = velocity = images = None


def frame_of(run, row, margins, joined_by=None):
    """`margins`: (lower, upper) corner of an open box about positions. What is given for axes along which nothing is repeated. `joined_by`: (M,) springs that
    must join nearest images."""
    from exports import padded
    out = Frame()
    x, d = padded(run.position(row)), run.dim
    out.velocity = padded(run.velocity(row)) if run.velocities is not None else None
    out.periodic = np.array((run.periodic + [False] * 3)[:3])
    if not out.periodic.any():
        out.low, high = margins(x)
        out.cell, out.position, out.images = np.diag(high - out.low), x, np.zeros(x.shape, np.int64)
        return out
    cell = np.eye(3)
    cell[:d, :d] = run.box_edges(row)
    turn = _turn(cell)
    cell, x = cell @ turn, x @ turn
    out.velocity = None if out.velocity is None else out.velocity @ turn
    joined = None if joined_by is None else _joined(run, row, cell, x, joined_by)
    out.low, high = margins(x)
    for k in range(3):
        if not out.periodic[k]:
            cell[k] = np.where(np.arange(3) == k, high[k] - out.low[k], 0)
    for k in (1, 2):
        for l in range(k - 1, -1, -1):  # the same lattice of boxes by edges that lean less
            if out.periodic[l] and out.periodic[k]:
                cell[k] -= np.round(cell[k, l] / cell[l, l]) * cell[l]
    if joined is not None:
        _check_joined(run, cell, x, out.periodic, joined)
    out.low = np.where(out.periodic, 0, out.low)
    place = (x - out.low) @ np.linalg.inv(cell)
    out.images = np.where(out.periodic, np.floor(place), 0).astype(np.int64)
    out.cell, out.position = cell, x - out.images @ cell
    return out


def _turn(cell):
    """The rotation (3, 3), x -> x @ turn, that lays the first edge along x and the second into the plane of x and y."""
    if not np.triu(cell, 1).any() and (np.diag(cell) > 0).all():
        return np.eye(3)
    turn, upper = np.linalg.qr(cell.T)
    turn = turn * np.sign(np.diag(upper))
    if np.linalg.det(turn) < 0:
        raise RunError("the edges of the periodic box are left-handed, which LAMMPS does not have: exchange two of them")
    return turn


def _joined(run, row, cell, position, which):
    """What springs (`which` of them) and the arms of angle springs join: a word for it, its row, pairs of particles, and the vectors (M, 3) to the image that is
    the second end."""
    springs, angles, out = run.springs, run.angles_at(row), []
    tables = [("spring", np.flatnonzero(which), springs.pairs[which], None if springs.shift is None else springs.shift[which])]
    for end in (0, 2) if angles else ():
        tables.append(("angle spring", angles.rows, angles.triples[:, [1, end]], None if angles.shift is None else angles.shift[:, end] - angles.shift[:, 1]))
    for word, rows, pairs, shift in tables:
        apart = position[pairs[:, 1]] - position[pairs[:, 0]]
        out.append((word, rows, pairs, apart if shift is None else apart + np.pad(shift, ((0, 0), (0, 3 - shift.shape[1]))) @ cell))
    return out


def _check_joined(run, cell, position, periodic, joined):
    """LAMMPS and HOOMD join nearest images."""
    for word, row, pairs, vectors in joined:
        apart = position[pairs[:, 1]] - position[pairs[:, 0]]
        seen = apart + nearest(cell, apart, periodic) @ cell
        wrong = np.flatnonzero((np.abs(seen - vectors) > 1e-6 * np.abs(cell).max()).any(axis=1))
        if len(wrong):
            a, b = pairs[wrong[0]]
            raise RunError(f"{run.path}: {word} {row[wrong[0]]} does not join the nearest images of particles {a} and {b}, and LAMMPS and HOOMD have no other bonds: "
                           "repeat the lattice, so that its box is larger than two springs")
