"""Particles chosen by words, as the program's -bs_group_NAME chooses them, by name and by place besides."""
import numpy as np

from backspring_io import RunError

FACES = {f"{axis}{end}": (k, end) for k, axis in enumerate("xyz") for end in ("min", "max")}
HELP = "faces of the bounding box (xmin,ymax), groups of the file by name, boxes (box:X0,Y0,Z0,X1,Y1,Z1), the particle nearest to a point (near:X,Y,Z), ids (ids:0,5,7-12)"


def _items(text):
    """[(word, numbers as text)]: a word ends where the next that is no number begins."""
    found = []
    for part in text.split(","):
        word, colon, number = part.strip().partition(":")
        if colon:
            found.append((word, [number]))
        elif found and found[-1][1] and word[:1] in "-+.0123456789" and word:
            found[-1][1].append(word)
        else:
            found.append((word, []))
    return found


def _reals(option, word, numbers, d):
    """The coordinates (d) of a point, or (2, d) of the corners of a box."""
    shape = (2, d) if word == "box" else (d,)
    try:
        values = np.array([float(v) for v in numbers])
    except ValueError:
        values = np.zeros(0)
    if len(values) != np.prod(shape) or not np.isfinite(values).all():
        raise RunError(f"{option} {word}:{','.join(numbers)}: needs {np.prod(shape)} numbers here, d = {d}: "
                       + ("the lower corner's coordinates, then the upper corner's" if word == "box" else "the coordinates of a point"))
    return values.reshape(shape)


def _by_ids(option, numbers, ids):
    """Mask of the ids given one by one or as ranges a-b."""
    mask = np.zeros(len(ids), bool)
    for text in numbers:
        first, _, last = text.partition("-")
        if not first.isdigit() or not (last or first).isdigit():
            raise RunError(f"{option} ids: '{text}' is no id: write ids and ranges such as ids:0,5,7-12")
        here = (ids >= int(first)) & (ids <= int(last or first))
        if not here.any():
            raise RunError(f"{option} ids: there is no particle {text}: they go from {ids.min()} to {ids.max()}")
        mask |= here
    return mask


def _nearest(option, point, position, ids):
    distance = np.sqrt(((position - point) ** 2).sum(axis=1))
    nearest = np.flatnonzero(distance <= distance.min() + 1e-9 * max(np.ptp(position, axis=0).max(), 1e-300))
    if len(nearest) > 1:
        raise RunError(f"{option} near:{','.join(f'{v:g}' for v in point)}: particles {ids[nearest[0]]} and {ids[nearest[1]]} are equally near; name a point nearer to one of them")
    return np.arange(len(position)) == nearest[0]


def _on_face(position, name):
    """Particles on a face of the bounding box, within 1e-6 of its size."""
    axis, end = FACES[name]
    column = position[:, axis]
    return np.abs(column - (column.min() if end == "min" else column.max())) <= 1e-6 * float(np.ptp(position, axis=0).max())


def select(text, position, ids, groups, option):
    """Mask (N,) of what `text` chooses of positions (N, d) with the ids (N,); groups {name: rows}. A group comes before a face of the same name."""
    mask, d = np.zeros(len(position), bool), position.shape[1]
    for word, numbers in _items(text) if text else []:
        if word == "box" and numbers:
            low, high = _reals(option, word, numbers, d)
            here = ((position >= low) & (position <= high)).all(axis=1)
            if not here.any():
                raise RunError(f"{option} box:{','.join(numbers)}: no particle lies in it")
            mask |= here
        elif word == "near" and numbers:
            mask |= _nearest(option, _reals(option, word, numbers, d), position, ids)
        elif word == "ids" and numbers:
            mask |= _by_ids(option, numbers, ids)
        elif word in groups and not numbers:
            mask[groups[word]] = True
        elif word in FACES and FACES[word][0] < d and not numbers:
            mask |= _on_face(position, word)
        else:
            known = [f for f in FACES if FACES[f][0] < d]
            raise RunError(f"{option} {word}: write {', '.join(known)}" + (f", a group ({', '.join(groups)})" if groups else "") + ", box:LOW,HIGH corners, near:POINT or ids:0,5,7-12")
    return mask
