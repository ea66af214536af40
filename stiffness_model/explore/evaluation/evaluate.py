"""From designs to metrics, each design by itself, so that no result depends on the worker or chunk that computes it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ...drawing.drive import Drive
from ...errors import InputError
from ...montecarlo.twist_torque_curve import BAND
from ...numerics.arrays import Array
from ..definition.design import design_drive
from ..definition.metrics import METRICS
from ..definition.parameters import Value
from ..definition.study import Limit, Study
from .cost import cost_class
from .response import Response, simulate_design


class Outcome(IntEnum):
    """How the evaluation of a design ended."""

    SIMULATED = 0
    OUT_OF_LIMITS = 1  # A limit on a metric of the drawing (undercut, size, cost ...) is violated: not simulated.
    DOES_NOT_PACK = 2  # The elements of a row do not fit: not simulated.
    TOO_SOFT = 3  # Does not reach the study's torque within `response.MAX_CRANK_TWIST`.
    NO_DRIVE = 4  # The drawing is refused: an element larger than its path, a size beyond a standard's table.


@dataclass(frozen=True, eq=False)
class Evaluations:
    """Evaluated designs. positions: (n, n_parameters) in the unit cube; metrics: (n, len(METRICS)), SI, NaN where not
    computed; outcome: (n,) of `Outcome`."""

    positions: Array
    metrics: Array
    outcome: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.positions)

    def column(self, name: str) -> Array:
        """One metric of all designs, (n,)."""
        return self.metrics[:, list(METRICS).index(name)]


def concatenate(parts: list[Evaluations]) -> Evaluations:
    """All evaluations one after the other."""
    return Evaluations(
        np.concatenate([p.positions for p in parts]),
        np.concatenate([p.metrics for p in parts]),
        np.concatenate([p.outcome for p in parts]),
    )


def values_at(study: Study, position: Array) -> dict[str, Value]:
    """The fields that the design at a position, (n_parameters,), changes in the base drawing."""
    varied = {p.name: p.at(float(x)) for p, x in zip(study.parameters, position, strict=True)}
    return {**study.fixed, **varied}


def evaluate(study: Study, positions: Array) -> Evaluations:
    """Evaluate the designs at positions (n, n_parameters) in the unit cube."""
    rows = [_evaluate_one(study, position) for position in positions]
    return Evaluations(
        positions,
        np.array([row[0] for row in rows]).reshape(len(rows), len(METRICS)),
        np.array([row[1] for row in rows], np.int8),
    )


def drive_at(study: Study, position: Array) -> Drive:
    """The drive of the design at a position, (n_parameters,). Raises `InputError` where it makes no drive."""
    return design_drive(study.base, values_at(study, position), study.packing, study.name)


def _evaluate_one(study: Study, position: Array) -> tuple[list[float], Outcome]:
    found = dict.fromkeys(METRICS, np.nan)
    try:
        drive = drive_at(study, position)
        limit = drive.usable_limit
        found.update(_metrics_of_drawing(drive, limit))
    except InputError:
        return list(found.values()), Outcome.NO_DRIVE
    outcome = Outcome.SIMULATED
    if not study.packing.fits(drive):
        outcome = Outcome.DOES_NOT_PACK
    elif any(
        METRICS[limit.metric].from_drawing and relative_violation(limit, found[limit.metric]) > 0
        for limit in study.limits
    ):
        outcome = Outcome.OUT_OF_LIMITS
    else:
        numbers = study.numbers
        response = simulate_design(drive, limit, numbers.torque, numbers.drives, numbers.twists, numbers.seed)
        if response is None:
            outcome = Outcome.TOO_SOFT
        else:
            found.update(_metrics_of_response(response, numbers.torque))
    return list(found.values()), outcome


def relative_violation(limit: Limit, value: float) -> float:
    """Excess of a value over a limit relative to the limit, or in its unit for a limit at 0; 0 within the limit."""
    over = max(value - limit.high, limit.low - value, 0.0)
    bound = limit.high if value > limit.high else limit.low
    return over / (abs(bound) or 1.0) if over > 0 else 0.0


def _metrics_of_drawing(drive: Drive, limit: float) -> dict[str, float]:
    angle = drive.path.pressure_angle(np.linspace(0.0, limit, 181)).max()
    deepest = drive.crank_radius + 2 * drive.element_radius + drive.eccentricity
    return {
        "cost_class": cost_class(drive),
        "undercut": 1 - limit / np.pi,
        "pressure_angle": float(angle),
        "diameter": 2 * deepest,
        "ratio": float(drive.transmission_ratio),
        "elements": float(drive.elements),
    }


def _metrics_of_response(response: Response, torque: float) -> dict[str, float]:
    curve = response.curve
    twist = float(curve.twist_at(torque))
    k = int(np.clip(np.searchsorted(curve.twist, twist), 1, len(curve.twist) - 1))
    part = (twist - curve.twist[k - 1]) / (curve.twist[k] - curve.twist[k - 1])
    band = np.percentile(response.torque[k - 1] + part * (response.torque[k] - response.torque[k - 1]), BAND)
    return {
        "stiffness": float(curve.stiffness_at(twist)),
        "twist": twist,
        "backlash": curve.backlash(torque),
        "lost_motion": curve.lost_motion(torque),
        "no_load_force": float(response.force[0].mean()),
        "no_load_sum": float(response.force_sum.mean()),
        "greatest_force": float(response.force[1].mean()),
        "pressure": response.pressure,
        "load_share": float(response.share.mean()),
        "scatter": float(band[1] - band[0]) / torque,
        "squeezed": response.squeezed,
    }
