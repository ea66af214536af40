"""Basic rating life of the crank's bearings after ISO 281, and why the elements' contacts have none.

    L10 = (C/P)^p  million revolutions,  p = 3 (ball bearings), 10/3 (roller bearings)

These are revolutions of the rings relative to each other. The inner ring is the eccentric and turns with the crank. The
outer ring carries the elements and turns by W per turn of the crank, W signed (`efficiency.min_sliding_power`: where
the elements dissipate least; -0.09 for the presets, whose rings turn backwards, +0.07 with 28 lobes). A turn of the
crank is therefore

    |1 - W|  revolutions of the bearing,

1.09 for the presets and 0.93 with 28 lobes, and lives in turns of the crank are L10/|1 - W|. P is the mean of order p
of the forces on the eccentrics over these revolutions (ISO 281, varying load and speed), which the virtual drives at
random angles sample. The life of all bearings together is (sum L^-e)^(-1/e) with Weibull's exponent e = 10/9 and 9/8
(ISO 281; Lundberg & Palmgren 1947). ISO 281 holds up to P = C/2 and for rings in rigid seats: here the outer ring is
the crank's surface, bent by the elements on it, so that the real life is shorter.

No standard covers the life of the elements' own contacts, and none is computed. Lundberg's and Palmgren's capacity of a
contact (ISO 281, ISO/TS 16281) is fitted to bearing raceways: circular, conforming, ground, in pure rolling, with every
point of the ring loaded once per ball. The gear's profile changes its curvature along the contact, and the elements
slide in their bores and roll back and forth on a stretch of the gear; static limits are in `static_safety`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..display import one_line
from ..drawing.drive import Drive
from ..errors import expect
from ..io.drawing_toml import DriveLike, as_drive
from ..montecarlo.solved_blocks import SolvedBlock, solved_blocks, sum_by_group
from ..numerics.arrays import Array
from .efficiency import min_sliding_power

LIFE_EXPONENT = {"ball": 3.0, "roller": 10 / 3}
"""p of L10, by type of bearing (ISO 281)."""
WEIBULL_EXPONENT = {"ball": 10 / 9, "roller": 9 / 8}
"""Slope e of the Weibull distribution of lives (ISO 281)."""
MAX_LOAD_RATIO = 0.5
"""Largest P/C for which ISO 281 holds."""


@dataclass(frozen=True)
class BearingLife:
    """Life of the crank's bearings at each twist; all arrays (n_twist,).

    torque: mean, N.m. load: equivalent dynamic load P of one bearing, N. relative_revolutions: mean revolutions of its
    rings against each other per turn of the crank. revolutions: L10 of one bearing in turns of the crank;
    system_revolutions: that of all bearings together; hours: the same at the drawing's crank speed, NaN without one.
    valid: whether P is at most C/2. Lives are infinite without load.
    """

    twist: Array
    torque: Array
    load: Array
    relative_revolutions: Array
    revolutions: Array
    system_revolutions: Array
    hours: Array
    valid: NDArray[np.bool_]

    def __repr__(self) -> str:
        return one_line(self)


def bearing_forces(drive: DriveLike, twist: ArrayLike, n_drives: int = 100, seed: int = 0) -> tuple[Array, Array]:
    """Force on every crank bearing, (n_drives, eccentrics, n_twist) N, and the drives' torques, (n_drives, n_twist)
    N.m.

    twist: (n_twist,) rad at the output.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1")
    >>> force, torque = bearing_forces(drive, [drive.max_twist], n_drives=20)
    >>> f"{force.mean() / 1e3:.1f} kN at {torque.mean():.0f} N.m"
    '5.2 kN at 282 N.m'
    """
    drive = as_drive(drive)
    blocks = [(_force(drive, block), _torque(block)) for block in solved_blocks(drive, twist, n_drives, seed)]
    force, torque = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return force, torque


def _force(drive: Drive, block: SolvedBlock) -> Array:
    c, crank = block.contacts, block.result.crank
    u_r, u_t = block.crank_normal()
    cos, sin = np.cos(c.beta), np.sin(c.beta)
    along = _per_bearing(drive, block, crank * (u_r * cos + u_t * sin))
    return np.hypot(along, _per_bearing(drive, block, crank * (u_t * cos - u_r * sin)))


def _torque(block: SolvedBlock) -> Array:
    return sum_by_group(block.result.output_torque, block.drive_index, block.n_drives).T


def _relative_revolutions(drive: Drive, block: SolvedBlock) -> Array:
    """|1 - W| of every bearing, (n_drives, eccentrics, n_twist); 1 for an eccentric without elements."""
    elements = _per_bearing(drive, block, np.ones_like(block.result.crank))
    ring = _per_bearing(drive, block, min_sliding_power(drive, block)[1]) / np.maximum(elements, 1)
    return np.abs(1 - ring)


def _per_bearing(drive: Drive, block: SolvedBlock, values: Array) -> Array:
    """Sums of values (n_twist, n) over each bearing's elements, (n_drives, eccentrics, n_twist)."""
    count = block.n_drives * drive.eccentrics
    return sum_by_group(values, block.eccentric, count).T.reshape(block.n_drives, drive.eccentrics, -1)


def bearing_life(drive: DriveLike, twist: ArrayLike, n_drives: int = 100, seed: int = 0) -> BearingLife:
    """Basic rating life of the crank's bearings at twists (n_twist,), rad at the output.

    Raises `InputError` if the drawing states no `bearing_capacity`.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1", bearing_capacity="40 kN", crank_speed="1500 rpm")
    >>> life = bearing_life(drive, [drive.max_twist], n_drives=20)
    >>> f"{life.load[0] / 1e3:.1f} kN, {life.revolutions[0] / 1e6:.0f} million revolutions"
    '5.3 kN, 401 million revolutions'
    """
    drive = as_drive(drive)
    capacity, kind = drive.beyond.bearing_capacity, drive.beyond.bearing_type
    expect(
        capacity > 0, "the crank bearings' dynamic load rating, such as bearing_capacity = '40 kN'", "none", drive.name
    )
    blocks = [
        (_force(drive, block), _relative_revolutions(drive, block), _torque(block))
        for block in solved_blocks(drive, twist, n_drives, seed)
    ]
    force, turns, torque = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    p, e = LIFE_EXPONENT[kind], WEIBULL_EXPONENT[kind]
    relative = turns.mean(axis=(0, 1))
    load = ((force**p * turns).mean(axis=(0, 1)) / relative) ** (1 / p)
    with np.errstate(divide="ignore"):
        revolutions = 1e6 * (capacity / load) ** p / relative
    system_revolutions = revolutions * drive.eccentrics ** (-1 / e)
    speed = drive.beyond.crank_speed
    hours = system_revolutions * 2 * math.pi / speed / 3600 if speed > 0 else np.full_like(system_revolutions, np.nan)
    angles = np.atleast_1d(np.asarray(twist, float))
    return BearingLife(
        angles,
        torque.mean(axis=0),
        load,
        relative,
        revolutions,
        system_revolutions,
        hours,
        load <= MAX_LOAD_RATIO * capacity,
    )
