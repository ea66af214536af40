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


def gap_of(study: Study, base: Fit, chosen: Fit) -> Gap:
    """Root mean squares over all samples, N.m."""
    samples = np.repeat(held_out(study), study.blocks.count.astype(int))
    slope = chosen.prediction.slope
    noise = float(np.sqrt(np.average(study.noise.variance(slope), weights=study.blocks.count)))
    before = residual(study, base)
    own = own_scatter_taken_out(study, chosen)
    if not chosen.names:
        held = _rms(before[samples])
        return Gap(_rms(before), _rms(before), noise, held, held, after_own_scatter=own)
    held_before, held_after = (_rms(residual(study, refitted(study, found))[samples]) for found in (base, chosen))
    return Gap(_rms(before), _rms(residual(study, chosen)), noise, held_before, held_after, after_own_scatter=own)


def spoken_against(study: Study, base: Fit, chosen: Fit) -> bool:
    """Whether runs that were not fitted speak against the names: the others show them well, and there they do harm."""
    if not chosen.names:
        return False
    rests = [(study.torque - refitted(study, f).prediction.torque) ** 2 for f in (base, chosen)]
    held = held_out(study)
    before, after = (float(np.mean(rest[held])) for rest in rests)
    without, with_names = (float(np.sum((rest / study.variance)[~held])) for rest in rests)
    shown = without - with_names > SHOWN * (base.chi_square - chosen.chi_square)
    return shown and after > UNCONFIRMED**2 * before


def own_scatter_taken_out(study: Study, found: Fit) -> float | None:
    """Rms, N.m, of a fit's residual less the likeliest scatter of this one drive; None where nothing scatters."""
    if study.scatter is None or not len(found.weighting.strength):
        return None
    rest = study.torque - found.prediction.torque
    own = np.repeat(scattered(study, found, rest), study.blocks.count.astype(int))
    return _rms(residual(study, found) - own)


def residual(study: Study, found: Fit) -> Array:
    """Measured less simulated torque of all samples, (n,) N.m."""
    return study.trace.torque - simulated_torque(corrected_model(study, found), study.trace, float(found.parameters[0]))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def refitted(study: Study, found: Fit) -> Fit:
    """The same set fitted without the blocks held out."""
    variance = np.where(held_out(study), 1e12 * study.variance, study.variance)
    twist = variance if study.scatter is None else study.scatter.twist
    weights = make_weights(variance, study.scatter, twist).with_size(found.weighting.size)
    return fit(study.predictor(found.names), study.torque, weights, found.box, found.parameters, refit_size=False)
