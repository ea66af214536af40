"""The gap between model and record, before and after, on all of it and on a regime that was not fitted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .fit import Fit, fit
from .result import Gap
from .study import Study, make_weights

Array = NDArray[np.float64]

HELD_SHARE = 3
"""Every third run is held out; of a single run the last third."""


def held_out(study: Study) -> NDArray[np.bool_]:
    """Blocks (n,) that a second fit leaves out."""
    runs = study.trace.run[study.blocks.first]
    numbers = np.unique(runs)
    if len(numbers) >= HELD_SHARE:
        return np.isin(runs, numbers[1::HELD_SHARE])
    return np.arange(len(runs)) >= len(runs) * 2 // HELD_SHARE


def gap_of(study: Study, base: Fit, chosen: Fit) -> Gap:
    """Root mean squares over all samples, N.m."""
    trace = study.trace
    samples = np.repeat(held_out(study), study.blocks.count.astype(int))

    def residual(found: Fit) -> Array:
        predictor = study.predictor(found.names)
        predictor.blocks = None
        return trace.torque - predictor(found.parameters).torque

    def rms(values: Array) -> float:
        return float(np.sqrt(np.mean(values**2)))

    slope = chosen.prediction.slope
    noise = float(np.sqrt(np.average(study.noise.variance(slope), weights=study.blocks.count)))
    before, after = residual(base), residual(chosen)
    held_before, held_after = rms(before[samples]), rms(before[samples])
    if chosen.names:
        held_before = rms(residual(refitted(study, base))[samples])
        held_after = rms(residual(refitted(study, chosen))[samples])
    return Gap(rms(before), rms(after), noise, held_before, held_after)


def refitted(study: Study, found: Fit) -> Fit:
    """The same set fitted without the blocks held out."""
    variance = np.where(held_out(study), 1e12 * study.variance, study.variance)
    twist = variance if study.scatter is None else study.scatter.twist
    weights = make_weights(variance, study.scatter, twist).with_size(found.weighting.size)
    return fit(study.predictor(found.names), study.torque, weights, found.box, found.parameters, refit_size=False)
