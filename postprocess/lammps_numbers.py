"""Numbers and rows of LAMMPS data files: finite, of the right width, one for each name, or the line is named."""
import numpy as np

from backspring_io import RunError
from run_data import counted


def reals(path, number, words, section):
    """Finite numbers, or the line is named."""
    values = []
    for word in words:
        try:
            values.append(float(word))
        except ValueError:
            raise RunError(f"{path}:{number}: '{word[:60]}' in {section} is not a number") from None
    if not np.isfinite(values).all():
        raise RunError(f"{path}:{number}: '{' '.join(words)[:60]}' in {section}: {words[int(np.argmin(np.isfinite(values)))]} is not a finite number")
    return values


def whole(path, number, word, section):
    """A whole number of 64 bits, or the line is named."""
    try:
        value = int(word)
    except ValueError:
        raise RunError(f"{path}:{number}: '{word[:60]}' in {section} is not a whole number") from None
    if not -2 ** 63 <= value < 2 ** 63:
        raise RunError(f"{path}:{number}: '{word[:60]}' in {section} has more than 64 bits; write whole numbers below {2 ** 63}")
    return value


def columns(path, number, words, names, section):
    """Refuses a row that has other columns than those of `names`, "id type atom1 atom2"."""
    if len(words) != len(names.split()):
        raise RunError(f"{path}:{number}: '{' '.join(words)[:60]}' in {section} has {counted(len(words), 'column')}; write {len(names.split())}: {names}")


def once(path, number, key, seen, section):
    """Refuses a row whose key another one had; `seen`: {key: line}."""
    if key in seen:
        raise RunError(f"{path}:{number}: {section} names {key} a second time, after line {seen[key]}; write one row for each")
    seen[key] = number


def harmonic(path, number, kind, numbers, section):
    """K and the rest value of a harmonic style, both 0 or more."""
    values = reals(path, number, numbers, section)
    if min(values) < 0:
        raise RunError(f"{path}:{number}: '{kind} {' '.join(numbers)}' in {section}: {min(values):g} is negative; a spring has K >= 0 and rests at 0 or more")
    return values
