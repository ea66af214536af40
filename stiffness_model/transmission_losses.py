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
RELIEFS = (0.0, 1.0)
"""Range of the relief over the inverse of the greatest load: up to half of the friction at that load. Chosen by
judgement."""
NEGLIGIBLE = 1e-9
"""Relief, over the inverse of the greatest load, that is rounding at the lower bound of the fit."""


def preloaded_friction(useful: ArrayLike, loss: ArrayLike) -> dict[str, float]:
    """Friction of contacts that a preload and the load press together, fitted to losses at several loads.

    useful: (n,) N.m at the crank, of the load without losses; loss: (n,) N.m at the crank. Returns `torque`, N.m,
    `fraction`, `exponent` and `relief`, 1/(N.m), of
    loss^exponent = torque^exponent + (fraction useful/(1 + relief useful))^exponent: the load relieves one flank of the
    preloaded contacts as it presses the other, so that both parts do not add; and where parts yield, the contacts share
    a great load in another way than a small one. The squared errors of the efficiencies in both directions are least.
    `stiffness`: N.m/rad.

    >>> found = preloaded_friction([0.0, 1.0, 2.0, 4.0], [0.3, 0.1**0.5, 0.13**0.5, 0.5])
    >>> {name: round(value, 3) for name, value in found.items()}
    {'torque': 0.3, 'fraction': 0.1, 'exponent': 2.0, 'relief': 0.0, 'stiffness': 500.0}
    """
    from scipy.optimize import least_squares

    u, lost = np.asarray(useful, float), np.asarray(loss, float)
    u, lost = u[lost > 0], lost[lost > 0]
    if not lost.size:
        return {"torque": 0.0, "fraction": 0.0}
    # Errors of the loss change the efficiency with the crank driving, and with the output driving unless it locks.
    by_driving, by_driven = 1 / (u + lost), np.divide(1.0, u, out=np.zeros_like(u), where=u > lost)
    scale = np.array([1.0, float(u.max()) or 1.0])

    def law(exponent: float, relief: float) -> tuple[float, float, Array]:
        part = u / (1 + relief * u)
        weight = np.hypot(by_driving, by_driven) / (exponent * lost ** (exponent - 1))
        powers = _nonnegative(np.stack([np.ones_like(u), part**exponent], axis=1), lost**exponent, weight)
        torque, fraction = powers ** (1 / exponent)
        return float(torque), float(fraction), (torque**exponent + (fraction * part) ** exponent) ** (1 / exponent)

    def errors(scaled: Array) -> Array:
        error = law(*(scaled / scale))[2] - lost
        return np.concatenate([error * by_driving, error * by_driven])

    low, high = np.transpose([EXPONENTS, RELIEFS])
    best: Any = least_squares(errors, [2.0, 0.1], bounds=(low, high), xtol=1e-12, ftol=1e-14, gtol=1e-12)
    exponent, relief = (float(value) for value in best.x / scale)
    relief = relief if relief * scale[1] > NEGLIGIBLE else 0.0
    torque, fraction, _ = law(exponent, relief)
    found = {"torque": torque, "fraction": fraction, "exponent": exponent, "relief": relief}
    return _with_stiffness(found, float(lost.max()))


def preloaded_loss(parameters: Mapping[str, float], useful: ArrayLike) -> Array:
    """Loss, N.m at the crank, (n,), that the parameters of `preloaded_friction` give; useful: as there."""
    u, n = np.asarray(useful, float), parameters["exponent"]
    by_load = parameters["fraction"] * u / (1 + parameters["relief"] * u)
    return (parameters["torque"] ** n + by_load**n) ** (1 / n)


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
