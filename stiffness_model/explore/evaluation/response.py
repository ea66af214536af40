"""What one design does at the study's torque: its mean curve, its forces, its pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...contact.element_contacts import build_contacts
from ...contact.usable_elements import UsableElements
from ...drawing.drive import Drive
from ...drawing.sampling import Deviations
from ...equilibrium.closed_form import closed_form
from ...montecarlo.twist_torque_curve import BAND, TwistTorqueCurve
from ...numerics.arrays import Array
from ...ratings.peak_pressure import peak_pressures
from ...ratings.pressure import wall_forces
from .sweep import SweepSegment, draw_elements, segment_at, sweep

MAX_CRANK_TWIST = 0.5
"""Crank twist, rad, up to which the study's torque is looked for. The paper's drives reach 0.07 to 0.34."""
_TRIALS = 24
_TRIAL_ELEMENTS = 48
_MARGIN, _FURTHER, _MOST_SWEEPS = 1.06, 1.3, 5
_DENSER = 1.5
"""Exponent of the spacing of the twists: they lie denser near zero, where the play ends."""
MIN_DRIVES_FOR_OFFSET = 16
"""Virtual drives from which on their common offset can be told from their scatter."""
PRESSURE_DRIVES = 16
"""Virtual drives behind the pressure, which goes with the cube root of the force and scatters little."""


@dataclass(frozen=True, eq=False)
class Response:
    """The virtual drives of one design at n_twist twists from zero to just beyond the study's torque.

    torque: (n_twist, n_drives), N.m; curve: its mean, freed of the
    sample's offset (band, stiffness, forces and shares of the curve are NaN: see
    `population.Population.curve`); force: (2, n_drives), N, greatest of any contact at no twist
    and at the torque; force_sum: (n_drives,), N, of all contacts at no twist; share: (n_drives,), greatest load
    share at the torque; pressure: Pa, greatest at gear and crank over a turn at the twist of the torque, 90th
    percentile of drives; squeezed: share of the usable elements that are larger than their bore.
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
    """Sweep the first `n_drives` virtual drives of `seed` up to `torque`, N.m; None if the mean drive never carries
    it. limit: the drive's `usable_limit`, rad."""
    end = _twist_at(drive, torque, limit)
    if end is None:
        return None
    elements = draw_elements(drive, limit, n_drives, seed)
    if not len(elements.contacts):
        return None
    end *= _MARGIN
    for _ in range(_MOST_SWEEPS):
        twist = end * np.linspace(0.0, 1.0, n_twist) ** _DENSER
        segments = sweep(elements, twist * drive.ratio)
        carried = np.concatenate([segment.per_drive(np.add, segment.result.output_torque) for segment in segments])
        mean = _mean(carried)
        if mean[-1] >= torque:
            return _response(drive, elements, twist, segments, carried, mean, torque, seed)
        end *= _FURTHER
    return None


def _twist_at(drive: Drive, torque: float, limit: float) -> float | None:
    """About the output twist, rad, at which a drive without scatter carries `torque`, N.m."""
    if limit <= 0:
        return None
    beta = limit * (2 * (np.arange(_TRIAL_ELEMENTS) + 0.5) / _TRIAL_ELEMENTS - 1)
    radius = {
        "element": drive.element_radius,
        "crank": drive.crank_radius,
        "cage": drive.element_radius,
        "gear": drive.element_radius,
    }
    mean = {part: np.full((1, beta.size), size + drive.tolerances[part].offset) for part, size in radius.items()}
    crank_twist = drive.orientation * np.geomspace(1e-4, MAX_CRANK_TWIST, _TRIALS)
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
    """Mean torque, (n_twist,), of the drives' torques (n_twist, n_drives) at twists from zero on.

    Without scatter a drive carries nothing at zero twist, and so does the mean of all drives; that of a hundred is
    off by a tenth of the drives' spread. What the torques at zero twist tell of those at the others is taken off (a
    control variate): a backlash of drive 2 then scatters by 2 % over the seeds instead of 190 %, its lost motion by
    2 % instead of 8 %.
    """
    mean, off = carried.mean(axis=1), carried[0] - carried[0].mean()
    spread = float(off @ off)
    if carried.shape[1] < MIN_DRIVES_FOR_OFFSET or spread == 0:
        return mean
    return mean - (carried * off).sum(axis=1) / spread * mean[0]


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
    # No metric looks at the band, forces and shares of the curve: percentiles at every twist cost a tenth of all.
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
    # At the torque: between the values at the twists around it.
    k = int(np.clip(np.searchsorted(mean, torque), 1, len(twist) - 1))
    part = (torque - mean[k - 1]) / (mean[k] - mean[k - 1])
    at_zero = _Loads(*segment_at(segments, 0))
    before, after = (_Loads(*segment_at(segments, j)) for j in (k - 1, k))

    def between(a: Array, b: Array) -> Array:
        return a + part * (b - a)

    few = min(elements.n_drives, PRESSURE_DRIVES)
    turning = peak_pressures(drive, between(twist[k - 1 : k], twist[k : k + 1]), few, seed, cage=False)
    return Response(
        carried,
        curve,
        np.stack([at_zero.greatest, between(before.greatest, after.greatest)]),
        at_zero.total,
        between(before.best, after.best) / nonzero_torque(between(carried[k - 1], carried[k])),
        float(np.percentile(turning.pressure[:, 0, :2].max(axis=1), BAND[1])),
        float((elements.contacts.cage_gap < 0).mean()),
    )


def nonzero_torque(values: Array) -> Array:
    """Torques to divide by: those that are nothing count as the least number."""
    return np.where(np.abs(values) > 0, np.abs(values), np.finfo(float).tiny)


class _Loads:
    """Forces at one twist: greatest: of any contact, N, total: of all contacts, N, best: greatest torque of one
    element, N.m; all (n_drives,)."""

    def __init__(self, segment: SweepSegment, k: int) -> None:
        result = segment.result
        loaded, other = wall_forces(segment.contacts, result.cage_plus[k] - result.cage_minus[k])
        greatest = np.maximum(np.maximum(result.gear[k], result.crank[k]), loaded)
        self.greatest = segment.per_drive(np.maximum, greatest[None])[0]
        self.total = segment.per_drive(np.add, (result.gear[k] + result.crank[k] + loaded + other)[None])[0]
        self.best = segment.per_drive(np.maximum, result.output_torque[k][None])[0]
