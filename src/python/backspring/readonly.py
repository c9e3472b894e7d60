"""Arrays that show a state, and do not hold it."""

from __future__ import annotations

from typing import Any, Callable, TypeVar, cast

import numpy as np

from .errors import InputError

Numbers = TypeVar("Numbers", bound="np.ndarray[Any, Any]")


class ReadOnly(np.ndarray[Any, Any]):
    """Numbers of a state: what is written into them would move nothing, and is refused. What is computed from them is an ordinary array, also by s.v *= 2,
    which sets s.v to the product."""

    def __setitem__(self, key: Any, value: Any) -> None:
        if not self.flags.writeable:
            raise InputError("these numbers are read-only, a copy of the state which nothing would follow: change a copy of your own and give it whole, "
                             "v = simulation.v.copy(); v[1] = 0; simulation.v = v")
        super().__setitem__(key, value)  # type: ignore[no-untyped-call]

    def __array_wrap__(self, array: Any, *_: Any) -> Any:
        return np.asarray(array) if array.ndim else array[()]

    def __repr__(self) -> str:
        return repr(np.asarray(self))


def _in_place(name: str) -> Callable[[Any, Any], Any]:
    ordinary = getattr(np.ndarray, name)
    return lambda self, other: ordinary(self, other) if self.flags.writeable else NotImplemented  # and Python takes the sum, the product, ...


for _name in ("add", "sub", "mul", "matmul", "truediv", "floordiv", "mod", "pow"):
    setattr(ReadOnly, f"__i{_name}__", _in_place(f"__i{_name}__"))


def read_only(numbers: Numbers) -> Numbers:
    """The same numbers, not to be written to."""
    shown = np.asarray(numbers).view(ReadOnly)
    shown.flags.writeable = False
    return cast(Numbers, shown)
