"""The types of arrays of double-precision numbers and of indices, and values of several arrays that can be compared."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class ArrayValue:
    """Base of frozen dataclasses (with eq=False) that hold arrays: equality by value, and a hash that agrees with it.

    The comparison that a dataclass generates fails for arrays. NaN equals NaN here.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, eq=False)
    ... class Samples(ArrayValue):
    ...     name: str
    ...     values: Array
    >>> one, other = (Samples("a", np.array([1.0, np.nan])) for _ in range(2))
    >>> one == other, len({one, other}), one == Samples("a", np.array([1.0, 2.0]))
    (True, 1, False)
    """

    def __eq__(self, other: object) -> bool:
        return equal_values(self, other) if type(other) is type(self) else NotImplemented

    def __hash__(self) -> int:
        values = (getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]
        return hash((type(self), *(v.shape if isinstance(v, np.ndarray) else v for v in values)))


def equal_values(a: Any, b: Any) -> bool:
    """Equality by value, of arrays and of dataclasses with arrays inside too; NaN equals NaN in arrays.

    Fields of dataclasses that do not take part in a comparison (`compare=False`) do not here either.
    """
    if a is b:
        return True
    if isinstance(a, np.ndarray):
        numeric = a.dtype.kind == "f"
        return isinstance(b, np.ndarray) and np.array_equal(a, b, equal_nan=numeric)
    if is_dataclass(a):
        compared = (f.name for f in fields(a) if f.compare)
        return type(a) is type(b) and all(equal_values(getattr(a, name), getattr(b, name)) for name in compared)
    return bool(a == b)
