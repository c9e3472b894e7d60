"""Keywords of Python as options of the program."""

import numbers

import numpy as np

from .errors import InputError


def text_of(name, value):
    """What stands behind an option on the command line: numbers with all their digits, lists with commas, flags as true and false."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return format(float(value), ".17g")
    if value is None:
        return ""
    try:
        return ",".join(text_of(name, one) for one in np.asarray(value, dtype=object).ravel())
    except (TypeError, RecursionError):
        raise InputError(f"option {name}: {value!r} is no number, text or list of them") from None


def settings_of(options):
    """[(name with its dash, text)] of keywords {name: value}; those whose value is None are left out, True gives a flag."""
    return [("-" + name, text_of(name, value)) for name, value in options.items() if value is not None]


def loads_of(loads, total):
    """Options of forces on groups. loads: {group: vector of d forces [N], or a text with expressions}; total: shared evenly by the group's particles."""
    settings = []
    for group, force in (loads or {}).items():
        shared = total if isinstance(total, bool) else group in total
        settings.append((f"-bs_force_{group}", text_of("loads", force) + (",total" if shared else "")))
    return settings
