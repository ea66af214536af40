"""Losses of a transmission as the parameters of friction at its crank, the effect `crank_friction` of `reefmu`.

With the torque U at the crank that a load gives without losses, dry friction F at the crank makes the efficiency
U/(U + F) with the crank driving, and 1 - F/U with the output driving.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .numerics.arrays import Array

PRESLIDING_ANGLE = 1e-3
"""rad at the crank, over which the greatest friction builds up before the crank slides: it gives the stiffness of the
friction, which data of losses do not state. Chosen by judgement, from some tens of um of tangential displacement of
contacts at some tens of mm from the axis."""
EXPONENTS = (1.0, 6.0)
"""Range of the exponent by which friction without load and with load combine: from a sum to nearly the greater of both,
which identical contacts would have. Chosen by judgement."""


def preloaded_friction(useful: ArrayLike, loss: ArrayLike) -> dict[str, float]:
    """Friction of contacts that a preload and the load press together, fitted to losses at several loads.

    useful: (n,) N.m at the crank, of the load without losses; loss: (n,) N.m at the crank. Returns `torque`, N.m,
    `fraction` and `exponent` of loss^exponent = torque^exponent + (fraction useful)^exponent: the load relieves one
    flank of the preloaded contacts as it presses the other, so that both parts do not add. The squared errors of the
    loss over the power driven in are least. `stiffness`: N.m/rad.

    >>> found = preloaded_friction([0.0, 2.0, 4.0], [0.3, 0.13**0.5, 0.5])
    >>> {name: round(value, 3) for name, value in found.items()}
    {'torque': 0.3, 'fraction': 0.1, 'exponent': 2.0, 'stiffness': 500.0}
    """
    from scipy.optimize import minimize_scalar

    u, lost = np.asarray(useful, float), np.asarray(loss, float)
    u, lost = u[lost > 0], lost[lost > 0]
    if not lost.size:
        return {"torque": 0.0, "fraction": 0.0}

    def linear(exponent: float) -> tuple[float, float]:
        weight = 1 / (exponent * lost ** (exponent - 1) * (u + lost))
        torque, fraction = _nonnegative(np.stack([np.ones_like(u), u**exponent], axis=1), lost**exponent, weight)
        return torque ** (1 / exponent), fraction ** (1 / exponent)

    def error(exponent: float) -> float:
        torque, fraction = linear(exponent)
        fitted = (torque**exponent + (fraction * u) ** exponent) ** (1 / exponent)
        return float((((fitted - lost) / (u + lost)) ** 2).sum())

    best: Any = minimize_scalar(error, bounds=EXPONENTS, method="bounded", options={"xatol": 1e-6})
    exponent = float(best.x)
    torque, fraction = linear(exponent)
    return _with_stiffness({"torque": torque, "fraction": fraction, "exponent": exponent}, float(lost.max()))


def tabulated_friction(speed: ArrayLike, useful: ArrayLike, efficiency: ArrayLike) -> dict[str, float]:
    """Friction fitted to efficiencies with the crank driving, as of a data sheet.

    speed: (n,) rad/s of the crank; useful: (n,) N.m at the crank, of the load without losses, above 0; efficiency: (n,)
    above 0, at most 1. Returns `torque`, N.m, `fraction` and `viscous`, N.m.s/rad, of
    loss = torque + fraction useful + viscous speed, none below 0, and `stiffness`, N.m/rad. Without different speeds
    `viscous` is 0.

    >>> found = tabulated_friction([100.0, 100.0, 300.0], [1.0, 3.0, 1.0], [1 / 1.2, 3 / 3.4, 1 / 1.22])
    >>> [round(found[name], 6) for name in ("torque", "fraction", "viscous")]
    [0.09, 0.1, 0.0001]
    """
    w, u, eta = (np.asarray(values, float) for values in (speed, useful, efficiency))
    loss = u * (1 / eta - 1)
    columns = np.stack([np.ones_like(u), u, w if np.ptp(w) > 0 else np.zeros_like(w)], axis=1)
    torque, fraction, viscous = _nonnegative(columns, loss, eta / u)
    return _with_stiffness({"torque": torque, "fraction": fraction, "viscous": viscous}, float(loss.max()))


def tabulated_efficiency(parameters: Mapping[str, float], speed: ArrayLike, useful: ArrayLike) -> Array:
    """Efficiency that the parameters of `tabulated_friction` give, (n,); speed, useful: as there."""
    u = np.asarray(useful, float)
    loss = parameters["torque"] + parameters["fraction"] * u + parameters["viscous"] * np.asarray(speed, float)
    return u / (u + loss)


def _nonnegative(columns: Array, values: Array, weight: Array) -> Array:
    from scipy.optimize import nnls

    scale = np.abs(columns * weight[:, None]).max(axis=0)
    scale[scale == 0] = 1.0
    return nnls(columns * weight[:, None] / scale, values * weight)[0] / scale


def _with_stiffness(parameters: Mapping[str, float], greatest_loss: float) -> dict[str, float]:
    found = {name: float(value) for name, value in parameters.items()}
    return {**found, **({"stiffness": greatest_loss / PRESLIDING_ANGLE} if greatest_loss > 0 else {})}
