"""Torque of one element over a whole trace, from `stiffness_model.lookup.element_table`.

Evaluated at a single clearance and only where the element carries load, which takes a fraction of the time.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.lookup.element_table import FADE_HALF_WIDTH, ElementTable
from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.bspline import locate, slope_weights, weights

from .elastic import SplineTable
from .vectorised import Number


def element_torque(
    table: ElementTable, twist: Array, clearance: Number, position: Number
) -> tuple[Array, Array, Array, Array]:
    """Torque, N.m, and its derivatives by twist, clearance and position, (n,) each, as `ElementTable.evaluate`.

    twist: (n,) rad; clearance: m; position: rad, of the element; numbers or (n,).
    """
    if isinstance(clearance, np.ndarray) and clearance.ndim:
        return table.evaluate(twist, clearance, position)
    beta = np.broadcast_to(np.asarray(position, float), twist.shape)
    beta = beta - 2 * np.pi * np.floor(beta / (2 * np.pi) + 0.5)
    carries = np.flatnonzero(np.abs(beta) < table.limit + FADE_HALF_WIDTH)
    side = np.where(beta[carries] < 0, -1.0, 1.0)
    away = np.abs(beta[carries])
    cell, g = (v[0] for v in locate(table.clearance, np.array([float(clearance)])))
    held = float(np.clip(g, 0.0, 1.0))
    strip = np.moveaxis(table.coefficients[:, int(cell) : int(cell) + 4], 1, 2)
    axes = (table.twist, table.position)
    value, by_twist, by_position = SplineTable(axes, strip @ np.array(weights(held, held), float)).evaluate(
        side * twist[carries], away
    )
    slope = np.array(slope_weights(held), float) / table.clearance.step * (0 <= g <= 1)
    by_clearance = SplineTable(axes, strip @ slope).evaluate(side * twist[carries], away)[0]
    fade = (table.limit - away) / (2 * FADE_HALF_WIDTH) + 0.5
    left = np.clip(fade, 0.0, 1.0)
    falls = np.where((fade > 0) & (fade < 1), -1 / (2 * FADE_HALF_WIDTH), 0.0)
    results = np.zeros((4, len(twist)))
    results[:, carries] = (
        side * left * value,
        left * by_twist,
        side * left * by_clearance,
        left * by_position + falls * value,
    )
    return results[0], results[1], results[2], results[3]
