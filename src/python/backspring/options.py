"""Keywords of Python as options of the program."""

from __future__ import annotations

import difflib
import inspect
import numbers
import operator
import os
from typing import Any, Callable, Dict, List, Mapping, Optional

import numpy as np

from .arguments import array_of, real_array
from .errors import InputError
from .kinds import Loads, Option, Settings, Shared

# Of PETSc's and SLEPc's names, also behind prefixes that solvers within solvers have, at least one part is one of these: classes, what they print, the library itself.
PETSC = frozenset("""ts snes ksp pc mat vec dm da is sf pf ao tao eps st svd pep nep mfn lme bv ds rg fn sub mg fieldsplit partitioner petscspace petscdualspace petscfe
    view viewer monitor draw log options memory malloc objects info help version citations flops error fp debugger signal mpi random saws device cuda hip gpu kokkos dll
    petscrc petsc display tmp condensed""".split())


def _whole_text(name: str, text: str) -> str:
    """The text, which PETSc would read up to a NUL alone: another name of a file, say, or of an option."""
    if "\0" in text:
        raise InputError(f"option {name}: {text!r} holds a NUL character: leave it out")
    return text


def text_of(name: str, value: Option) -> str:
    """What stands behind an option on the command line: numbers with all their digits, lists with commas, flags as true and false."""
    if isinstance(value, (str, os.PathLike)):
        return _whole_text(name, str(os.fspath(value)))
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


def _off(name: str, text: str) -> bool:
    """Whether it switches off what PETSc prints, which it does by being left out: behind the name PETSc wants where to print."""
    small = name.lower()
    return text == "false" and not small.startswith("-bs_") and any(part in small for part in ("monitor", "view", "converged_reason"))


def settings_of(options: Mapping[str, Option]) -> Settings:
    """[(name with its dash, text)] of keywords {name: value}; those whose value is None are left out. True gives a flag by its name alone, which is one to all
    that read options: PETSc's monitors would take a "true" behind it for a viewer."""
    if options.get("help") is not None:
        raise InputError("option help: it prints the options and computes nothing: run the program, backspring -help, or ask for help(backspring.statics)")
    given = {name: "" if isinstance(value, (bool, np.bool_)) and value else value for name, value in options.items() if value is not None}
    return [("-" + _whole_text(repr(name), name), text_of(name, value)) for name, value in given.items()]


def _is_petscs(name: str) -> bool:
    return any(part in PETSC for part in name.lower().split("_"))


def options_of(call: Callable[..., Any], options: Mapping[str, Option]) -> Settings:
    """The settings of what `call` was given beside its own keywords. What can be no option either is a misspelt one of those: without it something else would
    be computed. Of what may be PETSc's the program says which nothing has read."""
    own = [one.name for one in inspect.signature(call).parameters.values() if one.kind is not one.VAR_KEYWORD]
    for name in options:
        if not (name.lower().startswith("bs_") or _is_petscs(name)):
            near = difflib.get_close_matches(name.lower(), own, 1)
            advice = f"did you mean {near[0]}?" if near else "options of the program begin with bs_, those of PETSc with ts_, snes_, ksp_ and the like"
            raise InputError(f"{name}: no such argument; {advice}")
    return settings_of(options)


def whole(name: str, value: Any) -> int:
    """A whole number that an argument is."""
    try:
        return operator.index(value)
    except TypeError:
        raise InputError(f"{name}: {value!r} is no whole number") from None


def joined(earlier: Settings, later: Settings) -> Settings:
    """Settings, of which the later ones may replace earlier ones, or switch them off, but not say one thing twice, under whichever of an option's names."""
    from ._core import kept_name

    seen: Dict[str, str] = {}
    for name, _ in later:
        kept = kept_name(name).lower()
        if kept in seen:
            if seen[kept] != name:
                raise InputError(f"{seen[kept][1:]} and {name[1:]} are two names of one option: leave one out")
            raise InputError(f"{name[1:]} is given twice: by an argument and as an option, leave one out")
        seen[kept] = name
    return [one for one in earlier if kept_name(one[0]).lower() not in seen] + [one for one in later if not _off(*one)]


def _shared(total: Shared, groups: List[str]) -> List[str]:
    """The groups whose particles share their load."""
    if total is None or isinstance(total, (bool, np.bool_)):
        return groups if total else []
    try:
        names: List[Any] = [total] if isinstance(total, str) else list(total)
    except TypeError:
        names = [total]
    if isinstance(total, Mapping) or not all(isinstance(one, str) for one in names):
        raise InputError(f"total: {total!r}: give True, False, the name of a group or a list of names")
    for one in names:
        if one not in groups:
            raise InputError(f"total: there is no load on the group {one!r}")
    return names


def loads_of(loads: Optional[Loads], total: Shared, dim: int) -> Settings:
    """Options of forces on groups. loads: {group: vector of `dim` forces [N], or a text with expressions}; total: shared evenly by the group's particles."""
    if loads is not None and not isinstance(loads, dict):
        raise InputError(f"loads: {loads!r} is no {{group: force}}")
    given = {group: force for group, force in (loads or {}).items() if force is not None}
    shared, settings = _shared(total, list(given)), []
    for group, force in given.items():
        if not isinstance(force, str):
            force = real_array(f"loads[{group!r}]", force)
            force = array_of(f"loads[{group!r}]", force, () if dim == 1 and force.ndim == 0 else (dim,))
        settings.append((f"-bs_force_{group}", text_of("loads", force) + (",total" if group in shared else "")))
    return settings
