"""Fits without a regime of the record, and what that regime says of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .least_squares import Fit, fit
from .problem import Study, make_weights

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


def held_fits(study: Study, fits: Sequence[Fit]) -> list[Fit]:
    """The same sets fitted without the blocks held out."""
    variance = np.where(held_out(study), 1e12 * study.variance, study.variance)
    twist = variance if study.scatter is None else study.scatter.twist
    weights = make_weights(variance, study.scatter, twist)
    return [
        fit(
            study.predictor(f.names),
            study.torque,
            weights.with_size(f.weighting.size),
            f.box,
            f.parameters,
            refit_size=False,
        )
        for f in fits
    ]


def shrinks(study: Study, smaller: Fit, larger: Fit) -> float:
    """What the larger of two sets leaves of the blocks held out, over what the smaller leaves, rms."""
    held = held_out(study)
    before, after = (
        float(np.mean((study.torque - f.prediction.torque)[held] ** 2)) for f in held_fits(study, (smaller, larger))
    )
    return float(np.sqrt(after / max(before, 1e-300)))


def spoken_against(study: Study, base: Fit, chosen: Fit, held: Sequence[Fit]) -> bool:
    """Whether runs that were not fitted speak against the names: the others show them well, and there they do harm.

    held: `held_fits` of base and chosen.
    """
    rests = [(study.torque - f.prediction.torque) ** 2 for f in held]
    out = held_out(study)
    before, after = (float(np.mean(rest[out])) for rest in rests)
    without, with_names = (float(np.sum((rest / study.variance)[~out])) for rest in rests)
    shown = without - with_names > SHOWN * (base.chi_square - chosen.chi_square)
    return shown and after > UNCONFIRMED**2 * before
