"""Trajectories that the program wrote, and its tools in Python."""

from __future__ import annotations

import importlib
import os
import pathlib
import sys
from typing import Any, Union

from .errors import InputError

HERE = pathlib.Path(__file__).resolve().parent


def tools() -> pathlib.Path:
    """The folder of the tools: beside the source, or installed under share."""
    places = [HERE.parents[2] / "postprocess", *(up / "share" / "backspring" / "postprocess" for up in HERE.parents)]
    for folder in places:
        if (folder / "backspring_io.py").exists():
            return folder
    raise FileNotFoundError("the folder postprocess is not installed with this package: install the package backspring, too")


def tool(name: str) -> Any:
    """A module of the tools."""
    folder = str(tools())
    if folder not in sys.path:
        sys.path.append(folder)
    return importlib.import_module(name)


def open(path: Union[str, os.PathLike[str]]) -> Any:
    """A trajectory (F.h5md) as the tools read it: `times` (T,) [s], `position(k)`, `velocity(k)` (N, d) [m], [m/s] of the frame k, observables, springs;
    see postprocess/README.md."""
    reader = tool("backspring_io")
    try:
        return reader.open_run(path)
    except tool("open_hdf5").RunError as why:
        raise InputError(str(why)) from None
