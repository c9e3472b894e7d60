"""A study: option axes, the points they span, and the name under which each point is kept.

An axis is a list of settings; a setting is a dict of options without their dash, or {"np": ranks}.
"""
import hashlib
import itertools
import json
import os
import re
import shlex
from dataclasses import dataclass, field
from fractions import Fraction

from backspring_io import RunError

KEYS = {"options_file", "options", "vary", "zip", "np", "jobs", "reference", "against", "error", "program", "timeout",
        "interval", "output", "show", "average", "label"}


def _one(value):
    return isinstance(value, (str, int, float))


def _some(value):
    return _one(value) or isinstance(value, list) and all(map(_one, value))


def _table(value):
    return isinstance(value, dict) and all(isinstance(k, str) and (v is None or _some(v)) for k, v in value.items())


def _axes(value):
    return isinstance(value, str) or isinstance(value, list) and all(isinstance(v, str) for v in value) \
        or isinstance(value, dict) and all(isinstance(k, str) and isinstance(v, list) and all(_some(one) or _table(one) for one in v) for k, v in value.items())


# What a key of a study file holds, and words for it; one word or number for those that are not here.
SHAPES = {"options_file": (_some, "a name, or a list of names"), "options": (lambda v: isinstance(v, str) or _table(v), "a text as on the command line, or names with values"),
          "vary": (_axes, "names of options, each with a list of values"), "zip": (_some, "names of axes"), "np": (_some, "whole numbers"), "show": (_some, "names of columns"),
          "reference": (lambda v: _one(v) or _table(v), "finest, a file, or options")}


def _check_shapes(path, found):
    """Raises RunError for a value of another kind than its key has; words are texts from here on."""
    for key, value in found.items():
        fits, words = SHAPES.get(key, (_one, "one word or number"))
        if value is not None and not fits(value):
            raise RunError(f"{path}: {key}: {' '.join(repr(value).split())[:60]} is not {words}")
        if key in ("program", "output", "reference", "against", "error", "average", "label") and _one(value):
            found[key] = str(value)
        if key == "zip" and isinstance(value, list):
            found[key] = [str(v) for v in value]


def _words(text, where):
    """The words of a command line."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise RunError(f'{where} "{text}": {str(error).lower()}') from None


@dataclass
class Axis:
    """One thing that is varied: its name and its settings."""
    name: str
    settings: list


@dataclass
class Point:
    """One run of a study."""
    setting: dict                     # options that vary, in the order of the axes, np among them
    options: list = field(default_factory=list)   # the whole command line after the program's name
    ranks: int = 1
    name: str = ""                    # folder within the study

    def label(self):
        return " ".join(f"{k}={v}" for k, v in self.setting.items()) or "as given"


def split_values(text):
    """"a,b,c" -> [a, b, c]; where values hold commas themselves they are separated by semicolons."""
    return [v.strip() for v in text.split(";" if ";" in text else ",")]


def parse_vary(text):
    """"-ts_dt=0.1,0.05" -> Axis. "-a=1,2 -b=3,4" moves a and b together."""
    parts = _words(text, "--vary")
    columns = []
    for part in parts:
        name, found, values = part.partition("=")
        if not found or not name.startswith("-") or not name.lstrip("-") or "" in split_values(values):
            raise RunError(f'--vary "{text}": write "-option=value,value,..." (semicolons where values hold commas)')
        columns.append((name.lstrip("-"), split_values(values)))
    if not columns or len({len(v) for _, v in columns}) != 1:
        raise RunError(f'--vary "{text}": options that move together need equally many values')
    names = [n for n, _ in columns]
    return Axis(" ".join(names), [dict(zip(names, values)) for values in zip(*[v for _, v in columns])])


def as_text(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return ",".join(as_text(v) for v in value)
    return "" if value is None else str(value)


def axes_of_file(vary, path):
    """The axes of a YAML study: {option: [values]}, or {name: [{option: value, ...}, ...]}, or a list of strings as
    --vary takes them."""
    if isinstance(vary, (str, list)):
        return [parse_vary(text) for text in ([vary] if isinstance(vary, str) else vary)]
    axes = []
    for name, values in (vary or {}).items():
        if not isinstance(values, list) or not values:
            raise RunError(f"{path}: vary: {name}: write a list of values")
        sets = [v if isinstance(v, dict) else {name: v} for v in values]
        axes.append(Axis(str(name).lstrip("-"), [{k.lstrip("-"): as_text(v) for k, v in s.items()} for s in sets]))
    return axes


def read_file(path):
    """The YAML study file as a dict; raises RunError."""
    try:
        import yaml
    except ImportError:
        raise RunError("no yaml in this Python; install with: sudo apt-get install python3-yaml") from None
    if not os.path.isfile(path):
        raise RunError(f"{path}: no such file")
    try:
        with open(path, encoding="utf-8") as f:
            found = yaml.safe_load(f)
    except RecursionError:
        raise RunError(f"{path}: not a study file (brackets are nested too deeply)") from None
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise RunError(f"{path}: not a YAML file ({' '.join(str(error).split())})") from None
    if not isinstance(found, dict):
        raise RunError(f"{path}: expected keys such as options_file and vary")
    unknown = sorted(set(map(str, found)) - KEYS)
    if unknown:
        raise RunError(f"{path}: unknown key '{unknown[0]}'; there are {', '.join(sorted(KEYS))}")
    _check_shapes(path, found)
    return found


def option_words(options):
    """Options as a list of words: a dict {name: value}, or one string as on a command line."""
    if isinstance(options, str):
        return _words(options, "options")
    words = []
    for name, value in (options or {}).items():
        words += ["-" + str(name).lstrip("-")] + ([as_text(value)] if value is not None else [])
    return words


def zipped(axes, names):
    """The axes with those of `names` (all if empty) moved together as one; an axis of one value holds throughout."""
    chosen = [a for a in axes if not names or set(a.name.split()) & set(names)]
    missing = [n for n in names if not any(n in a.name.split() for a in axes)]
    if missing:
        raise RunError(f"--zip {missing[0]}: no such axis; there are {', '.join(a.name for a in axes)}")
    lengths = {len(a.settings) for a in chosen if len(a.settings) > 1}
    if len(lengths) > 1:
        raise RunError("--zip needs equally many values on every axis: "
                       + ", ".join(f"{a.name} has {len(a.settings)}" for a in chosen))
    count = max(lengths, default=1)
    rows = [{k: v for a in chosen for k, v in a.settings[i % len(a.settings)].items()} for i in range(count)]
    rest = [a for a in axes if a not in chosen]
    return rest + [Axis(" ".join(a.name for a in chosen), rows)] if chosen else rest


def span(axes):
    """Every combination of the axes' settings, the last axis fastest."""
    return [{k: v for part in parts for k, v in part.items()} for parts in itertools.product(*[a.settings for a in axes])]


def frame_interval(settings):
    """The shortest time that every varied -ts_dt divides, as text: frames there cut no step short. None if no step is
    varied, or if the steps have no such time of reasonable length (then only the first and the last frame are kept)."""
    steps = sorted({s["ts_dt"] for s in settings if "ts_dt" in s}, key=float)
    parts = [Fraction(s).limit_denominator(10 ** 12) for s in steps]
    parts = [p for p in parts if p > 0]  # a step that is none is refused by the program, in its own point
    if len(parts) < 2:
        return None
    common = parts[0]
    for p in parts[1:]:  # lcm(a/b, c/d) = lcm(ad, cb)/(bd)
        a, c = common.numerator * p.denominator, p.numerator * common.denominator
        common = Fraction(a * c // _gcd(a, c), common.denominator * p.denominator)
    return repr(float(common)) if common <= 64 * max(parts) else "1e300"


def _gcd(a, b):
    while b:
        a, b = b, a % b
    return a


def name_of(setting, options, ranks, files):
    """A folder name: readable, and a hash of all options and of the option files' content (not their paths), so that a changed study
    never mistakes one point for another."""
    digest = hashlib.sha256(json.dumps([[w for w in options if w not in files], ranks]).encode())
    for path in files:
        with open(path, "rb") as f:
            digest.update(f.read())
    words = "_".join(f"{k.split('_', 1)[-1]}-{v}" for k, v in setting.items())
    return (re.sub(r"[^A-Za-z0-9.+-]+", "_", words)[:60] or "point") + "_" + digest.hexdigest()[:8]
