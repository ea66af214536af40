"""A root between two points: SciPy's Brent method, to the last digits and with plain floats."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scipy import optimize


def bracketed_root(function: Callable[[float], float], low: float, high: float) -> float:
    """The x in low ... high at which `function` changes sign. Raises `ValueError` where it does not.

    >>> round(bracketed_root(lambda x: x * x - 2, 0.0, 2.0), 12)
    1.414213562373
    """
    # SciPy's own type hints do not know that the result is a float.
    solve: Any = optimize.brentq
    return float(solve(function, low, high, xtol=1e-18, rtol=4e-15))
