"""Checks of arguments: one exception, which names the argument and the row."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np

from .errors import InputError
from .kinds import Floats, Mask, Whole


def as_array(name: str, value: Any, what: str = "numbers") -> np.ndarray[Any, Any]:
    """An array of what was given, of whatever type, no entry of which is left out."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        raise InputError(f"{name}: give {what}, as many in every row") from None
    if isinstance(value, np.ma.MaskedArray) and np.any(value.mask):
        raise InputError(f"{name}: entries are masked: give all of them")
    return array


def real_array(name: str, value: Any) -> Floats:
    """An array of doubles; complex numbers and texts are refused, not converted."""
    array = as_array(name, value)
    if array.size and array.dtype.kind not in "biuf":
        raise InputError(f"{name}: give {'real ' if array.dtype.kind == 'c' else ''}numbers")
    return np.asarray(array, dtype=float)


def numbers_in(name: str, value: Any, rows: int, width: Optional[int] = None, positive: bool = False, limit: bool = False) -> Floats:
    """An array (rows,) or (rows, width) of finite doubles from what was given; one number, or one row, stands for all. limit: positive, or inf for what
    does not break."""
    array = real_array(name, value)
    shape = (rows,) if width is None else (rows, width)
    if array.shape != shape:
        if array.ndim > len(shape) - 1 or (array.ndim == 1 and array.shape != shape[1:]):
            raise InputError(f"{name} has the shape {array.shape}: give {shape}, or {'one number' if width is None else f'one row of {width}'}")
        array = np.broadcast_to(array, shape)
    array = np.array(array, dtype=float, order="C")
    bad = np.isnan(array) | (np.isinf(array) & (not limit)) | (array <= 0 if positive or limit else False)
    if bad.any():
        row = int(np.argwhere(bad)[0][0])
        wanted = "a positive number, or inf for what does not break" if limit else "a positive number" if positive else "finite"
        raise InputError(f"{name}, row {row}: {array[row]} is not {wanted}")
    return array


def array_of(name: str, value: Any, shape: Tuple[int, ...], positive: bool = False) -> Floats:
    """An array of just that shape."""
    array = real_array(name, value)
    if array.shape != shape:
        raise InputError(f"{name} has the shape {array.shape}: give {shape}")
    bad = np.argwhere(~np.isfinite(array) | (array <= 0 if positive else False))
    if len(bad):
        row, wanted = f", row {bad[0][0]}" if shape else "", "a positive number" if positive else "finite"
        raise InputError(f"{name}{row}: {array[bad[0][0]] if shape else array} is not {wanted}")
    return array


def one_of(value: Any, *names: str) -> str:
    """A name that an argument is."""
    if value not in names:
        raise InputError(f"{value!r}: give {', '.join(names[:-1])} or {names[-1]}")
    return str(value)


def name_of(name: str, value: Any) -> str:
    """A name that an argument is."""
    if not isinstance(value, str):
        raise InputError(f"{name}: {value!r} is no name")
    return value


def names_in(name: str, value: Any, rows: int) -> Union[str, List[str]]:
    """A name for all, or one for each of the rows."""
    array = np.asarray(value, dtype=object)  # among texts others stay what they are
    if array.ndim == 0:
        return name_of(name, value)
    names = [name_of(f"{name}, row {row}", one) for row, one in enumerate(array.ravel().tolist())]
    if array.shape != (rows,):
        raise InputError(f"{name} has {len(names)} names: give one, or {rows}, one for each spring")
    return names


def truths_in(name: str, value: Any, count: int) -> Tuple[bool, ...]:
    """So many truth values, of each edge of a box; texts and numbers beside 0 and 1 are refused, not converted."""
    array = as_array(name, value, "truth values")
    if array.shape != (count,) or array.dtype.kind not in "biu" or not np.isin(array, (0, 1)).all():
        raise InputError(f"{name}: {value!r}: give {count} truth value{'s' * (count != 1)}, one for each edge of the box")
    return tuple(bool(one) for one in array)


def rows_in(name: str, value: Any, width: Optional[int], count: int, place: str = "row", of: str = "particles") -> Whole:
    """A copy, (n, width), or (n,) where width is None, of rows of particles or springs; `place`: what one of them is called in messages."""
    array = as_array(name, value, "whole numbers")
    shape = "(n,)" if width is None else f"(n, {width})"
    if array.size == 0:
        return np.zeros((0,) if width is None else (0, width), np.int64)
    if array.ndim != (1 if width is None else 2) or (width and array.shape[1] != width) or array.dtype.kind not in "iu":
        raise InputError(f"{name} has the shape {array.shape} and the type {array.dtype}: give {shape} whole numbers, rows of {of}")
    outside = (array < 0) | (array >= count)
    bad = np.flatnonzero(outside if width is None else outside.any(axis=1))
    if bad.size:
        raise InputError(f"{name}, {place} {bad[0]}: {array[bad[0]].tolist()}: the {count} {of} count from 0 to {count - 1}")
    return np.array(array, np.int64, order="C")


def mask_of(name: str, value: Any, count: int, of: str = "particles") -> Mask:
    """A mask (count,) of truth values from rows or from a mask."""
    array = as_array(name, value, "rows or a mask")
    if array.dtype == bool:
        if array.shape != (count,):
            raise InputError(f"{name}: a mask of the shape {array.shape}: give ({count},), or rows")
        return array.copy()
    rows = rows_in(name, np.atleast_1d(array), None, count, "entry", of)
    mask = np.zeros(count, bool)
    mask[rows] = True
    if mask.sum() != rows.size:
        raise InputError(f"{name}: a row stands there twice: give each once, or a mask of {count} truth values")
    return mask


def whole_in(name: str, value: Any, rows: int, width: int) -> Whole:
    """(rows, width) whole numbers, counts of boxes."""
    numbers = numbers_in(name, value, rows, width)
    bad = np.flatnonzero((numbers != np.rint(numbers)).any(axis=1) | (np.abs(numbers) > 1e9).any(axis=1))
    if bad.size:
        raise InputError(f"{name}, row {bad[0]}: {numbers[bad[0]]} are no whole numbers of boxes")
    return numbers.astype(np.int64)


def named(name: str, value: Any) -> Dict[str, Any]:
    """A dictionary by names; None stands for an empty one."""
    if value is not None and not (isinstance(value, dict) and all(isinstance(key, str) for key in value)):
        raise InputError(f"{name}: {value!r} is no dictionary of values by names")
    return value or {}


def refuse_duplicates(pairs: Whole, shift: Optional[Whole]) -> None:
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
