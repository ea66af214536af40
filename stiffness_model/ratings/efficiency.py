"""Friction in the elements' contacts: losses, efficiency and no-load torque from the contact forces.

Coulomb friction with one coefficient mu at gear, crank and cage, to first order: the normal forces are those without
friction. Kinematics of a slow drive with the gear fixed, per radian of the crank: the cage turns by 1/i, the element
moves with it and along the path, v = (c' (1 - 1/i), c/i), and turns by w; the crank's surface is its bearing's ring,
which turns by W about the eccentric. The surfaces slide on each other by

    gear   v.t_n + w r                       crank  (v - v_E).t_u - w r - W R
    walls  v_r -+ (w - 1/i) r                 (radially: the element rises and sinks in its bore)

w and W are free. The balance of the elements' and the ring's moments is the least of the power lost,

    min over w, W of  sum mu N |sliding|,

(the frictional forces are its derivatives), so that an element rolls on the contact that outweighs the others and
slides on the rest. The ring's bearing, rolling resistance, spin about the contact normals and lubricant are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..display import one_line
from ..drawing.drive import Drive
from ..errors import expect
from ..io.drawing_toml import DriveLike, as_drive
from ..montecarlo.solved_blocks import SolvedBlock, solved_blocks, sum_by_group
from ..numerics.arrays import Array

_GOLDEN = (5**0.5 - 1) / 2
_STEPS = 60


@dataclass(frozen=True)
class FrictionLosses:
    """Losses of virtual drives by friction in their contacts.

    twist: (n_twist,) rad; torque: (n_drives, n_twist) N.m at the output, without friction; loss: (n_drives, n_twist)
    N.m at the crank: what friction adds to the torque that turns it; ratio: signed.
    """

    twist: Array
    torque: Array
    loss: Array
    ratio: float

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def efficiency(self) -> Array:
        """Of a crank that drives, (n_drives, n_twist): output power over output power and losses."""
        return _forward_efficiency(np.abs(self.torque / self.ratio), self.loss)

    @property
    def backdriving_efficiency(self) -> Array:
        """Of an output that drives the crank; 0 where friction holds it."""
        return _backdriving_efficiency(np.abs(self.torque / self.ratio), self.loss)

    def mean_efficiencies(self) -> tuple[Array, Array]:
        """Both efficiencies, (n_twist,), of the mean torque and loss: a drive's own at no torque tell nothing."""
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
    """Losses at twists (n_twist,), rad at the output, with the drawing's coefficient of friction or another.

    At no twist the loss is the no-load torque at the crank: drives whose parts overlap have one. Raises `InputError`
    where no coefficient is stated.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1", friction_coefficient=0.05)
    >>> losses = friction_losses(drive, [0.0, drive.max_twist], n_drives=8)
    >>> bool(0.7 < losses.efficiency[:, 1].mean() < 0.95)
    True
    """
    drive = as_drive(drive)
    mu = drive.beyond.friction_coefficient if coefficient is None else coefficient
    expect(
        0 < mu < 1, "a coefficient of friction above 0 and below 1, such as friction_coefficient = 0.05", mu, drive.name
    )
    torques, losses = [], []
    for block in solved_blocks(drive, twist, n_drives, seed):
        lost = mu * min_sliding_power(drive, block)[0]
        losses.append(sum_by_group(lost, block.drive_index, block.n_drives).T)
        torques.append(sum_by_group(block.result.output_torque, block.drive_index, block.n_drives).T)
    return FrictionLosses(
        np.atleast_1d(np.asarray(twist, float)), np.concatenate(torques), np.concatenate(losses), drive.ratio
    )


def sliding_velocities(drive: Drive, block: SolvedBlock) -> tuple[Array, Array, Array]:
    """Sliding at the contacts of elements and rings that do not turn, (4, m, n) m per radian of the crank, in the
    order of the forces; its changes with w, (4,) in radii r; and with W at the crank, -R (n,) m.
    """
    c = block.contacts
    cage = 1 / drive.ratio
    v_r, v_t = drive.path.slope(c.beta) * (1 - cage), c.path_radius * cage
    centre_r, centre_t = block.centre()
    u_r, u_t = block.crank_normal()
    radius = c.element_radius
    shape = block.result.gear.shape
    at_gear = np.broadcast_to(-v_r * c.normal_t + v_t * c.normal_r, shape)
    # The pin moves across its lever: (-E_t, E_r).
    at_crank = -(v_r + centre_t) * u_t + (v_t - centre_r) * u_r
    walls = [np.broadcast_to(v_r + side * cage * radius, shape) for side in (1, -1)]
    return np.stack([at_gear, at_crank, *walls]), np.array([1.0, -1.0, -1.0, 1.0]), -(c.radius_sum - radius)


def min_sliding_power(drive: Drive, block: SolvedBlock) -> tuple[Array, Array]:
    """Force times sliding of every element at the turns that lose least, (m, n) N.m per radian of the crank, and the
    turn W of each element's ring, (m, n).
    """
    slip, by_turn, by_ring = sliding_velocities(drive, block)
    r = block.result
    force = np.stack([r.gear, r.crank, r.cage_plus, r.cage_minus])
    radius = block.contacts.element_radius
    count = block.n_drives * drive.eccentrics

    def lost(ring: Array) -> Array:
        moved = slip.copy()
        moved[1] += by_ring * ring
        # The least of a sum of weighted distances lies where one of them is nought.
        nought = -moved / (by_turn[:, None, None] * radius)
        return np.min(
            [(force * np.abs(moved + by_turn[:, None, None] * radius * w)).sum(axis=0) for w in nought], axis=0
        )

    # Convex in the ring's turn, and least where some element rolls on the crank while another contact rolls too.
    bound = float(np.abs(slip).max(initial=0.0) / np.abs(by_ring).min(initial=1.0)) * 3 + 1
    low, high = np.full((slip.shape[1], count), -bound), np.full((slip.shape[1], count), bound)

    def total(ring: Array) -> Array:
        return sum_by_group(lost(ring[:, block.eccentric]), block.eccentric, count)

    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    values = [total(inner[0]), total(inner[1])]
    for _ in range(_STEPS):
        left = values[0] <= values[1]
        low, high = np.where(left, low, inner[0]), np.where(left, inner[1], high)
        kept, kept_value = np.where(left, inner[0], inner[1]), np.where(left, values[0], values[1])
        fresh = np.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        fresh_value = total(fresh)
        inner = [np.where(left, fresh, kept), np.where(left, kept, fresh)]
        values = [np.where(left, fresh_value, kept_value), np.where(left, kept_value, fresh_value)]
    ring = ((low + high) / 2)[:, block.eccentric]
    return lost(ring), ring
