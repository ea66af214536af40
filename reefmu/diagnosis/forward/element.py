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
    loaded = np.flatnonzero(np.abs(beta) < table.limit + FADE_HALF_WIDTH)
    side = np.where(beta[loaded] < 0, -1.0, 1.0)
    distance = np.abs(beta[loaded])
    cell, g = (v[0] for v in locate(table.clearance, np.array([float(clearance)])))
    held = float(np.clip(g, 0.0, 1.0))
    strip = np.moveaxis(table.coefficients[:, int(cell) : int(cell) + 4], 1, 2)
    axes = (table.twist, table.position)
    value, by_twist, by_position = SplineTable(axes, strip @ np.array(weights(held, held), float)).evaluate(
        side * twist[loaded], distance
    )
    slope = np.array(slope_weights(held), float) / table.clearance.step * (0 <= g <= 1)
    by_clearance = SplineTable(axes, strip @ slope).evaluate(side * twist[loaded], distance)[0]
    fade = (table.limit - distance) / (2 * FADE_HALF_WIDTH) + 0.5
    inside = np.clip(fade, 0.0, 1.0)
    inside_slope = np.where((fade > 0) & (fade < 1), -1 / (2 * FADE_HALF_WIDTH), 0.0)
    results = np.zeros((4, len(twist)))
    results[:, loaded] = (
        side * inside * value,
        inside * by_twist,
        side * inside * by_clearance,
        inside * by_position + inside_slope * value,
    )
    return results[0], results[1], results[2], results[3]
