"""An array over the frames of a file that is read when it is indexed."""
import numpy as np


class Frames:
    """A lazy array (T, ...): indexing reads from the file that much and no more. np.asarray(...) reads all of it."""

    def __init__(self, read, shape):
        """read(where): what a dataset, at least as large as `shape`, holds there."""
        self._read, self.shape = read, tuple(shape)
        self.ndim, self.dtype = len(self.shape), np.dtype(float)

    def __len__(self):
        return self.shape[0]

    def __getitem__(self, where):
        """As a numpy array of this shape would give it, one list of indices at most."""
        where = list(where) if isinstance(where, tuple) else [where]
        if any(w is Ellipsis for w in where):
            k = where.index(Ellipsis)
            where[k:k + 1] = [slice(None)] * (self.ndim - len(where) + 1)
        where += [slice(None)] * (self.ndim - len(where))
        if len(where) > self.ndim:
            raise IndexError(f"{len(where)} indices for an array of {self.ndim} dimensions")
        found = [_selection(w, n) for w, n in zip(where, self.shape)]
        out = np.asarray(self._read(tuple(read for read, _ in found)), dtype=float)
        axis = 0
        for read, after in found:
            if after is not None:  # HDF5 reads forwards and in order only
                out = np.take(out, after, axis)
            axis += not isinstance(read, int)
        return out

    def __iter__(self):
        return (self[k] for k in range(len(self)))

    def __array__(self, dtype=None):
        return np.asarray(self[...], dtype=dtype)


def _selection(where, n):
    """(what HDF5 is asked for, how to rearrange it or None) of one index along an axis of length n."""
    if isinstance(where, slice):
        start, stop, step = where.indices(n)
        if step > 0:
            return slice(start, max(start, stop), step), None
        rows = np.arange(start, stop, step)
        return _selection(rows, n)
    if np.ndim(where) == 0:
        row = int(where)
        if not -n <= row < n:
            raise IndexError(f"index {row} is outside an axis of length {n}")
        return row % n, None
    rows = np.asarray(where)
    rows = np.flatnonzero(rows) if rows.dtype == bool else rows.astype(np.int64)
    if len(rows) and (rows.min() < -n or rows.max() >= n):
        raise IndexError(f"indices are outside an axis of length {n}")
    unique, after = np.unique(rows % n, return_inverse=True)
    return (unique, after) if len(rows) else (slice(0, 0), None)
