"""The gap between model and record, before and after, on all of it and on a regime that was not fitted.

Every figure is of the model that goes out, run by `reefmu.simulate`; the engine that fits has no part in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.held_out import held_out
from ..estimation.least_squares import Fit
from ..estimation.problem import Study
from ..estimation.remainder import scattered
from ..schema import Gap
from .corrected_model import corrected_model, simulated_torque


def measure_gap(study: Study, base: Fit, chosen: Fit, held: Sequence[Fit]) -> Gap:
    """Root mean squares over all samples, N.m; held: `held_fits` of both, none where nothing is named."""
    samples = np.repeat(held_out(study), study.blocks.count.astype(int))
    slope = chosen.prediction.slope
    noise = float(np.sqrt(np.average(study.noise.variance(slope), weights=study.blocks.count)))
    before = after = residual(study, base)
    held_before = held_after = _rms(before[samples])
    if held:
        after = residual(study, chosen)
        held_before, held_after = (_rms(residual(study, found)[samples]) for found in held)
    own = own_scatter(study, chosen)
    return Gap(
        _rms(before),
        _rms(after),
        noise,
        held_before,
        held_after,
        after_own_scatter=None if own is None else _rms(after - own),
    )


def own_scatter(study: Study, found: Fit) -> Array | None:
    """The likeliest scatter (n,), N.m, of this one drive at all samples; None where nothing scatters."""
    if study.scatter is None or not len(found.weighting.strength):
        return None
    rest = study.torque - found.prediction.torque
    return np.repeat(scattered(study, found, rest), study.blocks.count.astype(int))


def residual(study: Study, found: Fit) -> Array:
    """Measured less simulated torque of all samples, (n,) N.m."""
    return study.trace.torque - simulated_torque(corrected_model(study, found), study.trace, float(found.parameters[0]))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
