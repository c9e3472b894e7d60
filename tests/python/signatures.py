#!/usr/bin/env python3
"""Types and words of the package: every public name, method and property has both, mypy finds nothing wrong in it, and finds what users do wrong."""
import inspect
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from helpers import HERE, PYTHON  # noqa: E402

import backspring as bs  # noqa: E402

ROOT = HERE.parents[1]
USED = """
import backspring as bs
import numpy as np
net: bs.Lattice = bs.Lattice(np.zeros((2, 2)), [[0, 1]], stiffness=3.0, groups={"end": [1]})
eq: bs.Equilibrium = bs.statics(net, loads={"end": (0, 1.0)}, snes_rtol=1e-9)
reveal_type(eq.x)
reveal_type(eq.energy)
for frame in bs.run(net, until=1.0, dt=0.1, stop=lambda t, frame: bool(frame.x.max() > 1)):
    reveal_type(frame.events.spring)
"""
WRONG = ("bs.statics(3)", "bs.Lattice([0.0], pears=[[0, 0]])", "bs.statics(net, load_steps='four')", "bs.run(net)", "eq.streched", "eq.energy.shape")


def members(one):
    """(name, function) of what a class offers."""
    for name, value in vars(one).items():
        if name.startswith("_") and name != "__init__":
            continue
        if isinstance(value, property):
            yield name, value.fget
        elif isinstance(value, (staticmethod, classmethod)):
            yield name, value.__func__
        elif inspect.isfunction(value):
            yield name, value


def lacking(name, function, words=True):
    """What a function has not."""
    signature = inspect.signature(function)
    found = [f"{name}: no type of {one}" for one, p in signature.parameters.items() if p.annotation is p.empty and one not in ("self", "cls")]
    if signature.return_annotation is signature.empty:
        found.append(f"{name}: no type of what it returns")
    return found + ([f"{name}: no words"] if words and not inspect.getdoc(function) else [])


def documented():
    """Docstrings and annotations; arrays with their shapes and units."""
    missing, seen = [], 0
    for name in bs.__all__:
        one = getattr(bs, name)
        own = one.__doc__ if inspect.isclass(one) else inspect.getdoc(one)
        if not own:
            missing.append(f"{name}: no words")
        if inspect.isfunction(one):
            missing += lacking(name, one)
            seen += 1
            continue
        for member, function in members(one):
            missing += lacking(f"{name}.{member}", function, words=member != "__init__")
            seen += 1
            said, back = inspect.getdoc(function) or "", str(inspect.signature(function).return_annotation)
            if back in ("Floats", "Whole", "Mask") and not re.search(r"\([NSK](, d)?,?\)|\(N, d\)|\(S, d\)", said):
                missing.append(f"{name}.{member}: no shape")
            if back == "Floats" and "[" not in said:
                missing.append(f"{name}.{member}: no unit")
        for attribute in getattr(one, "__annotations__", {}) if one.__module__.startswith("backspring") else ():
            if not re.search(rf"\b{attribute}\b", own or ""):
                missing.append(f"{name}.{attribute}: no words in the class's")
    assert not missing, "\n".join(missing)
    assert seen > 60, seen


def checked():
    """mypy, strictly; users' mistakes are told, what is right is not."""
    done = subprocess.run(["mypy", "--config-file", "src/python/mypy.ini", "--cache-dir", tempfile.gettempdir() + "/backspring_mypy"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    with tempfile.TemporaryDirectory() as folder:
        script = pathlib.Path(folder) / "user.py"
        script.write_text(USED + "\n".join(WRONG) + "\n")
        done = subprocess.run(["mypy", "--strict", "--cache-dir", folder, str(script)], env={"PATH": "/usr/bin:/bin", "MYPYPATH": PYTHON}, cwd=folder, capture_output=True, text=True)
    told = {int(line.split(":")[1]): line for line in done.stdout.splitlines() if "user.py" in line and ": error:" in line}
    first = USED.count("\n") + 1
    assert sorted(told) == list(range(first, first + len(WRONG))), done.stdout + done.stderr
    types = re.findall(r'Revealed type is "(.*)"', done.stdout)
    assert len(types) == 3 and "float" in types[0] and types[1] == "builtins.float" and "signedinteger" in types[2], types


def main():
    documented()
    print("documented: ok")
    if not shutil.which("mypy"):
        print("mypy is absent, types are not checked: apt install mypy")
        sys.exit(77)
    checked()
    print("checked by mypy: ok")


if __name__ == "__main__":
    main()
