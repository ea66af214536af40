"""Deviations of a whole curve: a base curve that is off within tolerance, or what all elements of a drive share.

The scatter of single elements makes ripple where it changes the curve; what is common to them changes the curve alone.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

CURVE_DEGREE = 2
"""Degree, in the size of the torque, of the factor by which a whole curve may be off. Chosen by judgement: scale and
bend are what parts that all elements share change; a column more costs 4 in -2 log likelihood where it is not needed
and brings up to 170 on simulated individuals without effects."""


def curve_columns(torque: Array, scatter: Array) -> Array:
    """(3, n) N.m, one standard deviation of each independent deviation of a curve in scale, bend and curvature over the
    size of its torque.

    torque: (n,) N.m, of the base curve; scatter: (n, n) (N.m)^2, covariance of individuals. The curve as a whole may be
    off by as much as these deviations make the curves of individuals differ.
    """
    size = np.abs(torque) / max(float(np.abs(torque).max(initial=0.0)), 1e-300)
    curves = torque * np.polynomial.legendre.legvander(2 * size - 1, CURVE_DEGREE).T
    inverse = np.linalg.pinv(curves)
    variances, directions = np.linalg.eigh(inverse.T @ scatter @ inverse)
    return np.sqrt(np.maximum(variances, 0.0))[:, None] * (directions.T @ curves)
