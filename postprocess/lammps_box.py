"""The box of a LAMMPS file: molecules put together again where its faces cut them."""
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


def unwrap(cell, position, images, pairs, periodic, where):
    """Positions (N, 3) outside of the box, and the number of bonds that its faces cut. `images` are the file's flags; along bonds, which
    LAMMPS takes between nearest images, they are set anew where the flags say otherwise. where(row): the bond's place, for a message."""
    images = images.copy()
    placed = position + images @ cell
    steps = nearest(cell, placed[pairs[:, 1]] - placed[pairs[:, 0]], periodic)
    cut = np.flatnonzero(steps.any(axis=1))
    if not len(cut):
        return placed, 0
    shift = _walk(len(position), pairs, steps, pairs[cut, 0])
    wrong = np.flatnonzero((shift[pairs[:, 1]] - shift[pairs[:, 0]] != steps).any(axis=1))
    if len(wrong):
        raise RunError(f"{where(wrong[0])} joins a molecule or network to its own image across the periodic box; periodic boxes are not "
                       "supported yet (if the box is not periodic, add --boundary f,f,f)")
    return position + (images + shift) @ cell, len(cut)


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
