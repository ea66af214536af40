"""Deviations of a whole curve: a base curve that is off within tolerance, or what all elements of a drive share.

The scatter of single elements makes ripple where it changes the curve; what is common to them changes the curve alone.
A curve that is fitted to one individual deviates by both: where the crank is locked at few angles, ripple looks like
scale, and a covariance that takes all of it for common hides a modulus that is far off.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

CURVE_DEGREE = 2
"""Degree, in the size of the torque, of the factor by which a whole curve may be off. Chosen by judgement: scale and
bend are what parts that all elements share change; a column more costs 4 in -2 log likelihood where it is not needed
and brings up to 170 on simulated individuals without effects."""


COMMON_SHARE = 0.1
"""Deviation of what all elements share, over that of curves that are fitted to individuals, of which parts that deviate
by themselves make the most. Chosen among 0, 0.1, 0.2, 0.3, 0.5 and 1 by the likelihood of records of individuals
(`tests/benchmarks/scatter/bench_common_deviations.py`), for which 0 is as good in the mean; on simulated individuals of
drives with wide tolerances 0 costs up to 50 in -2 log likelihood."""
SCALE = 0.01
"""Standard deviation of the factor of a whole curve, as of Young's modulus from one steel to the next: 1 % of the
torque is 2.5 % of the modulus. Chosen among 0, 0.005, 0.01, 0.02 and 0.03 by the same likelihood."""


def common_deviations(torque: Array, scatter: Array) -> Array:
    """(4, n) N.m, one standard deviation of each independent deviation of a curve that all elements of a drive share.

    torque: (n,) N.m, of the base curve; scatter: (n, n) (N.m)^2, covariance of individuals whose parts deviate by
    themselves.
    """
    return np.concatenate([COMMON_SHARE * curve_columns(torque, scatter), SCALE * torque[None]])


def curve_columns(torque: Array, scatter: Array) -> Array:
    """(3, n) N.m, one standard deviation of each independent deviation of a curve in scale, bend and curvature over the
    size of its torque.

    torque: (n,) N.m, of the base curve; scatter: (n, n) (N.m)^2, covariance of individuals. They make a curve that is
    fitted to an individual deviate as much as the individuals do, whatever else deviates.
    """
    size = np.abs(torque) / max(float(np.abs(torque).max(initial=0.0)), 1e-300)
    curves = torque * np.polynomial.legendre.legvander(2 * size - 1, CURVE_DEGREE).T
    inverse = np.linalg.pinv(curves)
    variances, directions = np.linalg.eigh(inverse.T @ scatter @ inverse)
    return np.sqrt(np.maximum(variances, 0.0))[:, None] * (directions.T @ curves)
