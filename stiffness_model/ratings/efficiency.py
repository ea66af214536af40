"""Friction in the elements' contacts: losses, efficiency and no-load torque from the contact forces.

Coulomb friction with one coefficient mu at gear, crank and cage, to first order: the normal forces are those without
friction. Kinematics at low speed with the gear fixed, per radian of the crank: the cage turns by 1/i, the element moves
with it and along the path, v = (c' (1 - 1/i), c/i), and spins by w; the crank's surface is the outer ring of its
bearing, which turns by W about the eccentric. The sliding velocities are

    gear   v.t_n + w r                       crank  (v - v_E).t_u - w r - W R
    walls  v_r -+ (w - 1/i) r                 (radial: the element rises and sinks in its bore)

w and W are free. The moment balances of elements and rings are the stationarity conditions of the minimum of the
dissipated power,

    min over w, W of  sum mu N |sliding|,

whose derivatives are the frictional forces. An element therefore rolls on the contact that outweighs the others and
slides on the rest. Bearing friction, rolling resistance, spin about the contact normals and lubricant are neglected.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..display import one_line
from ..drawing.drive import Drive
from ..errors import expect
from ..frozen_mapping import FrozenMapping
from ..io.drawing_toml import DriveLike, as_drive
from ..lookup.build_lookup import N_QUADRATURE_DRIVES
from ..montecarlo.solved_blocks import SolvedBlock, solved_blocks, spread_block, sum_by_group
from ..numerics.arrays import Array
from ..transmission_losses import preloaded_friction

_GOLDEN = (5**0.5 - 1) / 2
_STEPS = 60
FITTED_TWISTS = (0.0, 0.02, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 1.0)
"""Twists, over the greatest one, at which the friction of a model is fitted: denser where the efficiency rises."""


@dataclass(frozen=True)
class FrictionLosses:
    """Friction losses of virtual drives in their contacts.

    twist: (n_twist,) rad; torque: (n_drives, n_twist) N.m at the output, without friction; loss: (n_drives, n_twist)
    N.m at the crank, which friction adds to the driving torque; ratio: signed.
    """

    twist: Array
    torque: Array
    loss: Array
    ratio: float

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def efficiency(self) -> Array:
        """With the crank driving, (n_drives, n_twist): output power over the sum of output power and losses."""
        return _forward_efficiency(np.abs(self.torque / self.ratio), self.loss)

    @property
    def backdriving_efficiency(self) -> Array:
        """With the output driving the crank, (n_drives, n_twist); 0 where friction is self-locking."""
        return _backdriving_efficiency(np.abs(self.torque / self.ratio), self.loss)

    def mean_efficiencies(self) -> tuple[Array, Array]:
        """Both efficiencies, (n_twist,), from mean torque and mean loss; near zero torque those of single drives mean
        little.
        """
        useful, loss = np.abs(self.torque.mean(axis=0) / self.ratio), self.loss.mean(axis=0)
        return _forward_efficiency(useful, loss), _backdriving_efficiency(useful, loss)


def _forward_efficiency(useful: Array, loss: Array) -> Array:
    with np.errstate(invalid="ignore"):
        return np.where(useful > 0, useful / (useful + loss), 0.0)


def _backdriving_efficiency(useful: Array, loss: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(useful > loss, 1 - loss / useful, 0.0)


def friction_losses(
    drive: DriveLike, twist: ArrayLike, n_drives: int = 32, seed: int = 0, coefficient: float | None = None
) -> FrictionLosses:
    """Losses at twists (n_twist,), rad at the output, with the drawing's coefficient of friction or with `coefficient`.

    At zero twist the loss is the no-load torque at the crank, which drives with interference have. Raises `InputError`
    if no coefficient is stated.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1", friction_coefficient=0.05)
    >>> losses = friction_losses(drive, [0.0, drive.max_twist], n_drives=8)
    >>> bool(0.7 < losses.efficiency[:, 1].mean() < 0.95)
    True
    """
    drive = as_drive(drive)
    mu = _coefficient(drive, coefficient)
    torques, losses = [], []
    for block in solved_blocks(drive, twist, n_drives, seed):
        lost = mu * min_sliding_power(drive, block)[0]
        losses.append(sum_by_group(lost, block.drive_index, block.n_drives).T)
        torques.append(sum_by_group(block.result.output_torque, block.drive_index, block.n_drives).T)
    return FrictionLosses(
        np.atleast_1d(np.asarray(twist, float)), np.concatenate(torques), np.concatenate(losses), drive.ratio
    )


def expected_losses(drive: DriveLike, twist: ArrayLike, coefficient: float | None = None) -> FrictionLosses:
    """`friction_losses` of drives that represent all of the drawing, for means over drives, as the tables of a model.

    Near zero torque the losses are those of few drives whose elements are compressed, and the mean of drawn drives is
    uncertain: by 20 % of 32 drives of drive_3. Here `N_QUADRATURE_DRIVES` drives are spread evenly over the tolerances,
    each with its mirror image, so that the mean torque is zero at zero twist. Arguments and errors as there.
    """
    drive = as_drive(drive)
    mu = _coefficient(drive, coefficient)
    angles = np.atleast_1d(np.asarray(twist, float))
    torques, losses = [], []
    for side in (1, -1):
        block = spread_block(drive, side * angles, N_QUADRATURE_DRIVES)
        lost = mu * min_sliding_power(drive, block)[0]
        losses.append(sum_by_group(lost, block.drive_index, block.n_drives).T)
        torques.append(side * sum_by_group(block.result.output_torque, block.drive_index, block.n_drives).T)
    return FrictionLosses(angles, np.concatenate(torques), np.concatenate(losses), drive.ratio)


def _coefficient(drive: Drive, stated: float | None) -> float:
    mu = drive.beyond.friction_coefficient if stated is None else stated
    expect(
        0 < mu < 1, "a coefficient of friction above 0 and below 1, such as friction_coefficient = 0.05", mu, drive.name
    )
    return mu


@functools.lru_cache(maxsize=32)
def _fitted_friction(drive: Drive) -> FrozenMapping[str, float]:
    losses = expected_losses(drive, np.array(FITTED_TWISTS) * drive.max_twist)
    useful = np.abs(losses.torque.mean(axis=0) / drive.ratio)
    return FrozenMapping(preloaded_friction(useful, losses.loss.mean(axis=0)))


def contact_friction(drive: Drive) -> dict[str, dict[str, float]]:
    """Parameters of the effect `crank_friction` that dissipates what `expected_losses` states, by effect and name.

    Empty for a drawing without a coefficient of friction. The mean efficiencies agree to 0.01 in both directions at any
    load, for the presets with coefficients up to 0.3 (tests/unit/stiffness_model/ratings/test_efficiency.py).

    >>> from stiffness_model import load_drive
    >>> contact_friction(load_drive("drive_1"))
    {}
    >>> round(contact_friction(load_drive("drive_1", friction_coefficient=0.05))["crank_friction"]["fraction"], 2)
    0.09
    """
    if drive.beyond.friction_coefficient == 0:
        return {}
    return {"crank_friction": dict(_fitted_friction(drive))}


def sliding_velocities(drive: Drive, block: SolvedBlock) -> tuple[Array, Array, Array]:
    """Sliding velocities with elements and rings not spinning, (4, m, n) m per radian of the crank, in the order of the
    forces; their derivatives with respect to w, (4,) in units of r; and with respect to W at the crank, -R (n,) m.
    """
    c = block.contacts
    cage = 1 / drive.ratio
    v_r, v_t = drive.path.slope(c.beta) * (1 - cage), c.path_radius * cage
    centre_r, centre_t = block.centre()
    u_r, u_t = block.crank_normal()
    radius = c.element_radius
    shape = block.result.gear.shape
    at_gear = np.broadcast_to(-v_r * c.normal_t + v_t * c.normal_r, shape)
    # Velocity of the eccentric's centre per radian: perpendicular to its lever, (-E_t, E_r).
    at_crank = -(v_r + centre_t) * u_t + (v_t - centre_r) * u_r
    walls = [np.broadcast_to(v_r + side * cage * radius, shape) for side in (1, -1)]
    return np.stack([at_gear, at_crank, *walls]), np.array([1.0, -1.0, -1.0, 1.0]), -(c.radius_sum - radius)


def min_sliding_power(drive: Drive, block: SolvedBlock) -> tuple[Array, Array]:
    """Minimum of force times sliding, (m, n) N.m per radian of the crank for every element, over the spins w and W, and
    the W of each element's ring, (m, n).
    """
    slip, by_turn, by_ring = sliding_velocities(drive, block)
    r = block.result
    force = np.stack([r.gear, r.crank, r.cage_plus, r.cage_minus])
    radius = block.contacts.element_radius
    count = block.n_drives * drive.eccentrics

    def lost(ring: Array) -> Array:
        moved = slip.copy()
        moved[1] += by_ring * ring
        # A sum of weighted absolute values has its minimum where one of them is zero.
        zeros = -moved / (by_turn[:, None, None] * radius)
        return np.min(
            [(force * np.abs(moved + by_turn[:, None, None] * radius * w)).sum(axis=0) for w in zeros], axis=0
        )

    # Convex in W: golden-section search. At the minimum an element rolls on the crank and on another contact.
    bound = float(np.abs(slip).max(initial=0.0) / np.abs(by_ring).min(initial=1.0)) * 3 + 1
    low, high = np.full((slip.shape[1], count), -bound), np.full((slip.shape[1], count), bound)

    def total(ring: Array) -> Array:
        return sum_by_group(lost(ring[:, block.eccentric]), block.eccentric, count)

    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    values = [total(inner[0]), total(inner[1])]
    for _ in range(_STEPS):
        lower = values[0] <= values[1]
        low, high = np.where(lower, low, inner[0]), np.where(lower, inner[1], high)
        kept, kept_value = np.where(lower, inner[0], inner[1]), np.where(lower, values[0], values[1])
        fresh = np.where(lower, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        fresh_value = total(fresh)
        inner = [np.where(lower, fresh, kept), np.where(lower, kept, fresh)]
        values = [np.where(lower, fresh_value, kept_value), np.where(lower, kept_value, fresh_value)]
    ring = ((low + high) / 2)[:, block.eccentric]
    return lost(ring), ring
