"""Tolerance scatter of cycloidal drives along a record, from simulated individuals.

The contacts of a disc act together, so that no response of single contacts can be added up. Individuals of the
population are simulated instead, at the position of the discs that each block has, up to the unknown position at which
the record begins. A factor of an individual's stiffness is the scale of the base curve, which is fitted; every
individual is therefore divided by its factor, and what remains of its difference from the mean curve is the scatter:
play, the shape of the curve, and where the crank turns, the ripple. Its principal components have its covariance.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from stiffness_model.cycloidal.cycloidal_drive import CycloidalDrive
from stiffness_model.cycloidal.cycloidal_population import simulate_cycloidal
from stiffness_model.cycloidal.gear_turn import draw_gear
from stiffness_model.drawing.twist_limits import twist_limit
from stiffness_model.io.drawing_key import DrawingKey
from stiffness_model.numerics.arrays import Array

from ..preprocessing.trace import Blocks, Trace
from .tolerance_scatter import Spread, in_turn

N_COMPONENT_DRIVES, N_INDIVIDUALS = 96, 48
"""Individuals whose principal components are the random effects, and individuals that show how far drives without
effects reach; chosen by judgement: the variance that the components do not span is measured on the second and added."""
N_TWISTS = 121
"""Twists at which the curve of an individual is solved while the crank stands; chosen by judgement, a spacing of a
sixtieth of the greatest one, at which linear interpolation errs by some 0.1 % of full torque."""
MAX_TURNING_BLOCKS = 300
"""Blocks at which individuals of a turning drive are solved, evenly over the record, if it has more: between them the
deviation is interpolated. Chosen by judgement to bound the time."""
SHARE_OF_FULL_TWIST = 0.02
"""Change of the play, over the drawing's greatest twist, that counts as a standard deviation of it where changes of the
clearance are compared; chosen by judgement, because the components hold the scatter of the play itself."""


@dataclass(frozen=True)
class CycloidalScatter:
    """The scatter along one record.

    twist: (n,) rad, first estimate of the twist at the contacts, by block; grid: (g,) rad, twists of the curves, or
    empty where the crank turns; components: (m, g) or (m, n) N.m, of one standard deviation each; unspanned: (g,) or
    (n,) (N.m)^2; lever: m/rad, clearance over the twist that it frees; clearance_deviation: m.
    """

    twist: Array
    grid: Array
    components: Array
    unspanned: Array
    lever: float
    clearance_deviation: float

    @property
    def mean_clearance_deviation(self) -> float:
        """m, `clearance_deviation`: the play of a drive is one."""
        return self.clearance_deviation

    @property
    def crank_stands(self) -> bool:
        """Whether every individual has one curve along the whole record."""
        return len(self.grid) > 0

    def covariance_at(
        self, twist: Array, clearance: Array | float = 0.0, beside: Array | None = None, spread: Spread = in_turn
    ) -> Array:
        """See `ToleranceScatter`. A clearance shifts the flanks; where the crank turns, nothing is shifted."""
        if not self.crank_stands:
            return self.components.T @ self.components + np.diag(self.unspanned)
        at = np.sign(twist) * np.maximum(np.abs(twist) - np.asarray(clearance) / self.lever, 0.0)
        columns = np.stack([np.interp(at, self.grid, row) for row in self.components])
        return columns.T @ columns + np.diag(np.interp(at, self.grid, self.unspanned))


def cycloidal_scatter(
    drive: CycloidalDrive, trace: Trace, blocks: Blocks, twist: Array, lever: float
) -> tuple[CycloidalScatter, Array]:
    """The scatter along a record, and the torque of individuals less that of the mean drive, (N_INDIVIDUALS, n) N.m.

    twist: (n,) rad, first estimate of the twist at the contacts; lever: m/rad, of the base curve.
    """
    clearance_deviation = SHARE_OF_FULL_TWIST * drive.max_twist * lever
    # With the crank turned by this angle from its position without load, the twist is that of the record.
    position = drive.ratio * blocks.mean(trace.output)
    if np.ptp(position) <= 2 * np.pi / drive.pins:
        grid, deviations = _curves(DrawingKey(drive))
        components, unspanned = _components(deviations)
        scatter = CycloidalScatter(twist, grid, components, unspanned, lever, clearance_deviation)
        individuals = np.stack([np.interp(twist, grid, row) for row in deviations[N_COMPONENT_DRIVES:]])
        return scatter, individuals
    deviations = _along(drive, position, twist)
    components, unspanned = _components(deviations)
    scatter = CycloidalScatter(twist, np.zeros(0), components, unspanned, lever, clearance_deviation)
    return scatter, deviations[N_COMPONENT_DRIVES:]


@functools.lru_cache(maxsize=4)
def _curves(key: DrawingKey[CycloidalDrive]) -> tuple[Array, Array]:
    """Twists (g,), rad, and deviations of individuals from the mean curve at them, (count, g) N.m, each at a position
    of its own."""
    drive = key.drive
    reach = min(2 * drive.max_twist, twist_limit(drive))
    grid = np.linspace(-reach, reach, N_TWISTS)
    return grid, _without_scale(simulate_cycloidal(drive, grid, N_COMPONENT_DRIVES + N_INDIVIDUALS, seed=1).torque)


def _along(drive: CycloidalDrive, position: Array, twist: Array) -> Array:
    """Deviations of individuals, (count, n) N.m, at the positions (n,), rad, and twists (n,), rad, of a turning drive;
    the position at which the record begins is random."""
    every = max(1, len(twist) // MAX_TURNING_BLOCKS)
    chosen = np.unique([*range(0, len(twist), every), len(twist) - 1])
    reach = twist_limit(drive)
    at, place = np.clip(twist[chosen, None], -reach, reach), np.arange(len(twist))
    torque: list[Array] = []
    for seed in range(N_COMPONENT_DRIVES + N_INDIVIDUALS):
        gear = draw_gear(drive, seed)
        start = float(gear.deviations.crank_angle[0])
        torque.append(np.interp(place, chosen, gear.at(start + position[chosen], at).torque[:, 0]))
    return _without_scale(np.array(torque))


def _without_scale(torque: Array) -> Array:
    """Deviations of torques (count, n) from their mean, every one divided by the factor that brings it closest."""
    mean = torque.mean(axis=0)
    factor = torque @ mean / float(mean @ mean)
    return torque / factor[:, None] - mean


def _components(deviations: Array) -> tuple[Array, Array]:
    """Principal components (m, n), of one standard deviation each, of the first deviations, and the mean square (n,) of
    the others that the components do not span."""
    first, others = deviations[:N_COMPONENT_DRIVES], deviations[N_COMPONENT_DRIVES:]
    _, size, rows = np.linalg.svd(first / np.sqrt(len(first)), full_matrices=False)
    # Half of the components hold nearly all variance; with all of them the individuals that made them have no rest.
    kept = slice(0, len(first) // 2)
    rest = others - others @ rows[kept].T @ rows[kept]
    return size[kept, None] * rows[kept], (rest**2).mean(axis=0)
