"""The response of one design up to the study's torque: mean curve, contact forces, pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...contact.element_contacts import build_contacts
from ...contact.usable_elements import UsableElements
from ...drawing.drive import Drive
from ...drawing.sampling import Deviations, nominal_radii
from ...equilibrium.closed_form import closed_form
from ...montecarlo.twist_torque_curve import BAND, TwistTorqueCurve
from ...numerics.arrays import Array
from ...ratings.peak_pressure import peak_pressures
from ...ratings.pressure import wall_forces
from .sweep import SweepSegment, draw_elements, segment_at, sweep

MAX_CRANK_TWIST = 0.5
"""Greatest crank twist, rad, at which the study's torque is sought. The paper's drives reach 0.07 to 0.34."""
_TRIAL_TWISTS, _TRIAL_ELEMENTS = 24, 48
"""Size of the estimate of the twist at the torque, which `_MARGIN` must cover; chosen by judgement."""
_MARGIN, _WIDENING, _MAX_SWEEPS = 1.06, 1.3, 5
"""A sweep ends at the estimated twist times the margin; where the mean drive does not reach the torque, it is repeated
up to a twist wider by the second factor, so many times at most. Chosen by judgement."""
_SPACING_EXPONENT = 1.5
"""Exponent of the spacing of the twists, which are denser near zero, where the backlash ends; chosen by judgement."""
MIN_DRIVES_FOR_OFFSET = 16
"""Fewest virtual drives for which the offset of the sample's mean is corrected: fewer do not resolve its correlation
with the torque. Chosen by judgement."""
PRESSURE_DRIVES = 16
"""Virtual drives behind the pressure, which grows with the cube root of the force and so scatters little."""


@dataclass(frozen=True, eq=False)
class Response:
    """The virtual drives of one design at n_twist twists from zero to just beyond the study's torque.

    torque: (n_twist, n_drives), N.m; curve: its mean, corrected for the sample's offset (its band, stiffness, forces
    and load shares are NaN); force: (2, n_drives), N, greatest of any contact at zero twist and at the torque;
    force_sum: (n_drives,), N, of all contacts at zero twist; share: (n_drives,), greatest load share at the torque;
    pressure: Pa, greatest at gear and crank over a turn at the twist of the torque, 90th percentile of the drives;
    squeezed: share of the usable elements that are larger than their bore.
    """

    torque: Array
    curve: TwistTorqueCurve
    force: Array
    force_sum: Array
    share: Array
    pressure: float
    squeezed: float


def simulate_design(
    drive: Drive, limit: float, torque: float, n_drives: int, n_twist: int, seed: int
) -> Response | None:
    """Sweep the first `n_drives` virtual drives of `seed` over `n_twist` twists up to `torque`, N.m.

    limit: the drive's `usable_limit`, rad. None if the mean drive does not reach the torque within `MAX_CRANK_TWIST`.
    """
    end = _twist_at(drive, torque, limit)
    if end is None:
        return None
    elements = draw_elements(drive, limit, n_drives, seed)
    if not len(elements.contacts):
        return None
    end *= _MARGIN
    for _ in range(_MAX_SWEEPS):
        twist = end * np.linspace(0.0, 1.0, n_twist) ** _SPACING_EXPONENT
        segments = sweep(elements, twist * drive.ratio)
        carried = np.concatenate([segment.per_drive(np.add, segment.result.output_torque) for segment in segments])
        mean = _mean(carried)
        if mean[-1] >= torque:
            return _response(drive, elements, twist, segments, carried, mean, torque, seed)
        end *= _WIDENING
    return None


def _twist_at(drive: Drive, torque: float, limit: float) -> float | None:
    """Estimated output twist, rad, at which a drive without scatter carries `torque`, N.m; None if it never does."""
    if limit <= 0:
        return None
    beta = limit * (2 * (np.arange(_TRIAL_ELEMENTS) + 0.5) / _TRIAL_ELEMENTS - 1)
    mean = {
        part: np.full((1, beta.size), radius + drive.tolerances[part].offset)
        for part, radius in nominal_radii(drive).items()
    }
    crank_twist = drive.orientation * np.geomspace(1e-4, MAX_CRANK_TWIST, _TRIAL_TWISTS)
    result = closed_form(build_contacts(drive, Deviations(beta=beta[None], **mean)), crank_twist)
    carried = result.output_torque.mean(axis=1) * drive.elements * limit / np.pi
    reached = np.flatnonzero(carried >= torque)
    if not reached.size:
        return None
    k = int(reached[0])
    twist = crank_twist / drive.ratio
    if k == 0:
        return float(twist[0])
    part = (torque - carried[k - 1]) / (carried[k] - carried[k - 1])
    return float(twist[k - 1] + part * (twist[k] - twist[k - 1]))


def _mean(carried: Array) -> Array:
    """Mean, (n_twist,), of the drives' torques (n_twist, n_drives) at twists from zero on.

    The torque at zero twist, whose expectation is zero, is a control variate: its regression on the torques at the
    other twists is subtracted. Otherwise the mean of a hundred drives is off by a tenth of their standard deviation;
    the backlash of drive 2 scatters by 2 % over the seeds instead of 190 %, its lost motion by 2 % instead of 8 %.
    """
    mean, deviation = carried.mean(axis=1), carried[0] - carried[0].mean()
    square = float(deviation @ deviation)
    if carried.shape[1] < MIN_DRIVES_FOR_OFFSET or square == 0:
        return mean
    return mean - (carried * deviation).sum(axis=1) / square * mean[0]


def _response(
    drive: Drive,
    elements: UsableElements,
    twist: Array,
    segments: list[SweepSegment],
    carried: Array,
    mean: Array,
    torque: float,
    seed: int,
) -> Response:
    # No metric uses band, forces and shares of the curve; percentiles at every twist would take a tenth of the time.
    unknown = np.full((len(twist), 4), np.nan)
    curve = TwistTorqueCurve(
        twist,
        mean,
        torque_p10=unknown[:, 0],
        torque_p90=unknown[:, 0],
        stiffness=unknown[:, 0],
        contact_force=unknown,
        load_share=unknown[:, 0],
        name=drive.name,
    )
    # Values at the torque are interpolated between the two twists around it.
    k = int(np.clip(np.searchsorted(mean, torque), 1, len(twist) - 1))
    part = (torque - mean[k - 1]) / (mean[k] - mean[k - 1])
    at_zero = _loads(*segment_at(segments, 0))
    before, after = (_loads(*segment_at(segments, j)) for j in (k - 1, k))

    def between(a: Array, b: Array) -> Array:
        return a + part * (b - a)

    few = min(elements.n_drives, PRESSURE_DRIVES)
    turning = peak_pressures(drive, between(twist[k - 1 : k], twist[k : k + 1]), few, seed, cage=False)
    return Response(
        carried,
        curve,
        np.stack([at_zero.force, between(before.force, after.force)]),
        at_zero.force_sum,
        between(before.element_torque, after.element_torque) / nonzero_torque(between(carried[k - 1], carried[k])),
        float(np.percentile(turning.pressure[:, 0, :2].max(axis=1), BAND[1])),
        float((elements.contacts.cage_gap < 0).mean()),
    )


def nonzero_torque(values: Array) -> Array:
    """Magnitudes of torques as divisors: zero becomes the smallest positive number."""
    return np.where(np.abs(values) > 0, np.abs(values), np.finfo(float).tiny)


class _Loads(NamedTuple):
    """Loads at one twist, (n_drives,). force: greatest of any contact, N; force_sum: of all contacts, N;
    element_torque: greatest torque of one element, N.m."""

    force: Array
    force_sum: Array
    element_torque: Array


def _loads(segment: SweepSegment, k: int) -> _Loads:
    """The loads at the k-th twist of a segment."""
    result = segment.result
    loaded, other = wall_forces(segment.contacts, result.cage_plus[k] - result.cage_minus[k])
    greatest = np.maximum(np.maximum(result.gear[k], result.crank[k]), loaded)
    return _Loads(
        segment.per_drive(np.maximum, greatest[None])[0],
        segment.per_drive(np.add, (result.gear[k] + result.crank[k] + loaded + other)[None])[0],
        segment.per_drive(np.maximum, result.output_torque[k][None])[0],
    )
