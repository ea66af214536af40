"""A root within a bracket by Brent's method (SciPy), to full precision and with plain floats."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scipy import optimize


def bracketed_root(function: Callable[[float], float], low: float, high: float) -> float:
    """The x in low ... high at which `function` changes sign. Raises `ValueError` if it does not.

    >>> round(bracketed_root(lambda x: x * x - 2, 0.0, 2.0), 12)
    1.414213562373
    """
    # SciPy's type hints do not state that the result is a float.
    solve: Any = optimize.brentq
    return float(solve(function, low, high, xtol=1e-18, rtol=4e-15))
