"""Networks in memory."""

import copy

import numpy as np

from .errors import InputError


def _numbers(name, value, rows, width=None, positive=False):
    """An array (rows,) or (rows, width) of finite doubles from what was given; one number, or one row, stands for all."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: give numbers") from None
    shape = (rows,) if width is None else (rows, width)
    if array.shape != shape:
        if array.ndim > len(shape) - 1 or (array.ndim == 1 and array.shape != shape[1:]):
            raise InputError(f"{name} has the shape {array.shape}: give {shape}, or {'one number' if width is None else f'one row of {width}'}")
        array = np.broadcast_to(array, shape)
    array = np.array(array, dtype=float, order="C")
    bad = ~np.isfinite(array) | (array <= 0 if positive else False)
    if bad.any():
        row = int(np.argwhere(bad)[0][0])
        raise InputError(f"{name}, row {row}: {array[row]} is not {'a positive number' if positive else 'finite'}")
    return array


def _rows(name, value, count):
    """A mask (count,) from rows or from a mask."""
    array = np.asarray(value)
    if array.dtype == bool:
        if array.shape != (count,):
            raise InputError(f"{name}: a mask of the shape {array.shape}: give ({count},), or rows")
        return array.astype(np.uint8)
    if array.size == 0:
        return np.zeros(count, np.uint8)
    if array.dtype.kind not in "iu" or array.ndim > 1:
        raise InputError(f"{name}: give rows of particles (whole numbers from 0), or a mask of {count} truth values")
    array = array.reshape(-1)
    bad = np.flatnonzero((array < 0) | (array >= count))
    if bad.size:
        raise InputError(f"{name}, entry {bad[0]}: row {array[bad[0]]} is none of the {count} particles, which count from 0")
    mask = np.zeros(count, np.uint8)
    mask[array] = 1
    return mask


def _pairs(pairs, count):
    array = np.asarray(pairs)
    if array.size == 0:
        return np.zeros((0, 2), np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":
        raise InputError(f"pairs has the shape {array.shape} and the type {array.dtype}: give (S, 2) whole numbers, rows of the particles at a spring's ends")
    bad = np.flatnonzero(((array < 0) | (array >= count)).any(axis=1))
    if bad.size:
        raise InputError(f"pairs, row {bad[0]}: {array[bad[0]].tolist()}: the {count} particles count from 0 to {count - 1}")
    return np.ascontiguousarray(array, np.int64)


def _refuse_duplicates(pairs, shift):
    """A spring between the same particles, by way of the same image, twice; and one from a particle to itself."""
    turned = pairs[:, 0] > pairs[:, 1]
    keys = np.where(turned[:, None], pairs[:, ::-1], pairs)
    if shift is not None:
        keys = np.hstack([keys, np.where(turned[:, None], -shift, shift)])
    else:
        same = np.flatnonzero(pairs[:, 0] == pairs[:, 1])
        if same.size:
            raise InputError(f"pairs, row {same[0]}: a spring from particle {pairs[same[0], 0]} to itself")
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    again = np.flatnonzero(first[inverse.reshape(-1)] != np.arange(len(keys)))
    if again.size:
        row = int(again[0])
        raise InputError(f"pairs, row {row}: the spring {pairs[row].tolist()} stands in row {int(first[inverse.reshape(-1)[row]])} already; "
                         "add up their stiffnesses, or give parallel=True")


class Lattice:
    """A network of N particles and S springs in d dimensions.

    x: (N, d) positions [m]; (N,) in one dimension.
    pairs: (S, 2) rows of the particles at the ends, from 0.
    stiffness: (S,) or one number [N/m] (strain law: [N]); rest_length: (S,) or one number [m], by default the initial distances.
    damping: (S,) or one number [kg/s].
    mass: (N,) or one number [kg], > 0; velocity: (N, d) [m/s].
    fixed: rows of particles, or a mask (N,). groups: {name: rows or mask}, for loads, motions and reactions.
    box: (d,) lengths or (d, d) edges of a periodic box, rows [m]; periodic: which of the edges repeat, by default all; shift: (S, d) the image of the
    box in which a spring's second end lies, by default the nearest.
    law: hooke, strain, zero and the other laws of the option bs_spring_law. spring_columns: {name: (S,)} numbers that a law takes beyond these;
    particle_columns: {name: (N,) or (N, d)}: radius, drag, force.
    parallel: allows several springs between the same particles.
    """

    def __init__(self, x, pairs=(), *, stiffness=1.0, rest_length=None, damping=0.0, mass=1.0, velocity=0.0, fixed=(), groups=None, box=None, periodic=None,
                 shift=None, law="hooke", spring_columns=None, particle_columns=None, parallel=False):
        x = np.asarray(x, dtype=float) if np.ndim(x) != 1 else np.asarray(x, dtype=float)[:, None]
        if x.ndim != 2 or not 1 <= x.shape[1] <= 3 or len(x) == 0:
            raise InputError(f"x has the shape {x.shape}: give (N, d) with at least one particle in 1 to 3 dimensions")
        n, d = x.shape
        self.x = _numbers("x", x, n, d)
        self.pairs = _pairs(pairs, n)
        s = len(self.pairs)
        self.stiffness = _numbers("stiffness", stiffness, s)
        self.rest_length = None if rest_length is None else _numbers("rest_length", rest_length, s)
        self.damping = _numbers("damping", damping, s)
        self.mass = _numbers("mass", mass, n, positive=True)
        self.velocity = np.zeros((n, d)) if np.ndim(velocity) == 0 and velocity == 0 else _numbers("velocity", velocity, n, d)
        self.fixed = _rows("fixed", fixed, n).astype(bool)
        self.groups = {name: _rows(f"groups[{name!r}]", rows, n).astype(bool) for name, rows in (groups or {}).items()}
        self.law = law
        self._set_box(box, periodic, shift, s, d)
        if not parallel:
            _refuse_duplicates(self.pairs, self.shift)
        self.spring_columns = {name: _numbers(f"spring_columns[{name!r}]", v, s) for name, v in (spring_columns or {}).items()}
        self.particle_columns = {name: _numbers(f"particle_columns[{name!r}]", v, n, np.shape(v)[1] if np.ndim(v) == 2 else None)
                                 for name, v in (particle_columns or {}).items()}

    def _set_box(self, box, periodic, shift, s, d):
        self.box, self.periodic, self.shift = None, (False,) * d, None
        if box is None:
            if periodic is not None or shift is not None:
                raise InputError("periodic and shift: give the box, too")
            return
        box = np.asarray(box, dtype=float)
        self.box = _numbers("box", np.diag(box) if box.ndim == 1 else box, d, d)
        self.periodic = tuple(bool(one) for one in (periodic if periodic is not None else (True,) * d))
        if len(self.periodic) != d:
            raise InputError(f"periodic has {len(self.periodic)} entries: give {d}, one for each edge of the box")
        if shift is not None:
            self.shift = _numbers("shift", shift, s, d).astype(np.int64)

    @property
    def dim(self):
        """Dimensions of space."""
        return self.x.shape[1]

    def __len__(self):
        return len(self.x)

    def replace(self, **changes):
        """A copy with other values of some arguments of the constructor."""
        given = dict(x=self.x, pairs=self.pairs, stiffness=self.stiffness, rest_length=self.rest_length, damping=self.damping, mass=self.mass,
                     velocity=self.velocity, fixed=self.fixed, groups=self.groups, box=self.box, periodic=self.periodic if self.box is not None else None,
                     shift=self.shift, law=self.law, spring_columns=self.spring_columns, particle_columns=self.particle_columns, parallel=True)
        return Lattice(**{**copy.copy(given), **changes})

    def __repr__(self):
        box = "" if self.box is None else f", periodic along {sum(self.periodic)} edges"
        return f"<backspring.Lattice: {len(self)} particles and {len(self.pairs)} springs in {self.dim} dimensions, {int(self.fixed.sum())} fixed{box}>"

    def _arrays(self):
        """For the extension."""
        from . import _core

        arrays = _core.LatticeArrays()
        arrays.dim = self.dim
        arrays.position, arrays.velocity, arrays.mass, arrays.fixed = self.x, self.velocity, self.mass, self.fixed
        arrays.springs, arrays.stiffness, arrays.damping = self.pairs, self.stiffness, self.damping
        if self.rest_length is not None:
            arrays.rest_length = self.rest_length
        for name, value in self.spring_columns.items():
            arrays.set_spring_column(name, value)
        for name, value in self.particle_columns.items():
            arrays.set_particle_column(name, value)
        for name, member in self.groups.items():
            arrays.add_group(name, member)
        if self.box is not None:
            arrays.set_box(list(self.periodic), self.box.ravel().tolist())
            if self.shift is not None:
                arrays.shift = self.shift
        return arrays

    def _settings(self):
        return [("-bs_spring_law", self.law)]
