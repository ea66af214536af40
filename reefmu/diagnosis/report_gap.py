"""The gap between model and record, before and after, on all of it and on a regime that was not fitted.

Every figure is of the model that goes out, run by `reefmu.simulate`; the engine that fits has no part in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .corrected import corrected_model, simulated_torque
from .fit import Fit, fit
from .remainder import scattered
from .result import Gap
from .study import Study, make_weights

Array = NDArray[np.float64]

Held = tuple[Fit, Fit] | None
"""Fits of the base and of the names without the runs held out."""

UNCONFIRMED = 1.2
"""What is left of runs that were not fitted, over that before, rms, from which they speak against the names."""
SHOWN = 0.3
"""Share of what the names gain that the fitted runs alone must show."""
HELD_SHARE = 3
"""Every third run is held out; of a single run the last third."""


def held_out(study: Study) -> NDArray[np.bool_]:
    """Blocks (n,) that a second fit leaves out."""
    runs = study.trace.run[study.blocks.first]
    numbers = np.unique(runs)
    if len(numbers) >= HELD_SHARE:
        return np.isin(runs, numbers[1::HELD_SHARE])
    return np.arange(len(runs)) >= len(runs) * 2 // HELD_SHARE


def gap_of(study: Study, base: Fit, chosen: Fit, held: Held) -> Gap:
    """Root mean squares over all samples, N.m; held: `held_fits` of both."""
    samples = np.repeat(held_out(study), study.blocks.count.astype(int))
    slope = chosen.prediction.slope
    noise = float(np.sqrt(np.average(study.noise.variance(slope), weights=study.blocks.count)))
    before = after = residual(study, base)
    held_before = held_after = _rms(before[samples])
    if held is not None:
        after = residual(study, chosen)
        held_before, held_after = (_rms(residual(study, found)[samples]) for found in held)
    own = own_scatter(study, chosen)
    return Gap(_rms(before), _rms(after), noise, held_before, held_after,
               after_own_scatter=None if own is None else _rms(after - own))


def held_fits(study: Study, base: Fit, chosen: Fit) -> Held:
    """Both fitted without the blocks held out; None where nothing is named."""
    if not chosen.names:
        return None
    variance = np.where(held_out(study), 1e12 * study.variance, study.variance)
    twist = variance if study.scatter is None else study.scatter.twist
    weights = make_weights(variance, study.scatter, twist)
    first, second = (fit(study.predictor(f.names), study.torque, weights.with_size(f.weighting.size), f.box,
                         f.parameters, refit_size=False) for f in (base, chosen))
    return first, second


def spoken_against(study: Study, base: Fit, chosen: Fit, held: Held) -> bool:
    """Whether runs that were not fitted speak against the names: the others show them well, and there they do harm."""
    if held is None:
        return False
    rests = [(study.torque - f.prediction.torque) ** 2 for f in held]
    out = held_out(study)
    before, after = (float(np.mean(rest[out])) for rest in rests)
    without, with_names = (float(np.sum((rest / study.variance)[~out])) for rest in rests)
    shown = without - with_names > SHOWN * (base.chi_square - chosen.chi_square)
    return shown and after > UNCONFIRMED**2 * before


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
