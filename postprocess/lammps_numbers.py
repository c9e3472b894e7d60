"""Numbers of LAMMPS data files: finite, or the line is named."""
import numpy as np

from backspring_io import RunError


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


def harmonic(path, number, kind, numbers, section):
    """K and the rest value of a harmonic style, both 0 or more."""
    values = reals(path, number, numbers, section)
    if min(values) < 0:
        raise RunError(f"{path}:{number}: '{kind} {' '.join(numbers)}' in {section}: {min(values):g} is negative; a spring has K >= 0 and rests at 0 or more")
    return values
