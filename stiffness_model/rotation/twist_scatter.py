"""Scatter of the twist under torque among several individuals of one drawing, relative to the mean of all drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..display import one_line
from ..drawing.drive import Drive
from ..errors import expect
from ..io.drawing_toml import DriveLike, as_drive
from ..lookup.build_lookup import mean_torque
from ..numerics.arrays import Array
from .element_positions import low_discrepancy_angles
from .individual_drive import draw_individual
from .maps import turning_map

N_TWISTS, N_ANGLES, N_TORQUES = 61, 180, 81
"""Twists, output angles and torques at which the individuals are compared; chosen by judgement."""


@dataclass(frozen=True)
class TwistScatter:
    """Twists of individuals minus that of the drawing's mean drive, rad at the output.

    torque: (n,) N.m from -full to full; mean_twist: (n,) rad, of the mean drive; seeds: of the individuals; mean, low,
    high: (n_individuals, n) rad, mean, minimum and maximum over a turn of the output.
    """

    drive: Drive
    seeds: tuple[int, ...]
    torque: Array
    mean_twist: Array
    mean: Array
    low: Array
    high: Array

    def __repr__(self) -> str:
        return one_line(self)


def twist_scatter(drive: DriveLike, seeds: Sequence[int]) -> TwistScatter:
    """Individuals of given seeds, up to the mean torque at nine tenths of the drawing's max_twist.

    Raises `InputError` without any seed, or for a drive without torque.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> found = twist_scatter(load_drive("drive_1"), range(3))
    >>> found.mean.shape, bool(abs(found.mean).max() < 0.3 * ARCMIN)
    ((3, 81), True)
    """
    drive = as_drive(drive)
    expect(len(seeds) > 0, "at least one seed", list(seeds), "seeds")
    twist = np.linspace(-1.4, 1.4, N_TWISTS) * drive.max_twist
    mean = mean_torque(drive, twist)
    full = float(np.interp(0.9 * drive.max_twist, twist, mean))
    expect(full > 0, "a max_twist at which the drive carries torque", full, drive.name)
    torque = np.linspace(-full, full, N_TORQUES)
    mean_twist = np.interp(torque, mean, twist)
    angle = low_discrepancy_angles(N_ANGLES)
    rows = []
    for seed in seeds:
        maps = turning_map(draw_individual(drive, int(seed)), twist, angle).torque
        twists = np.array([np.interp(torque, one, twist) for one in maps]) - mean_twist
        rows.append((twists.mean(axis=0), twists.min(axis=0), twists.max(axis=0)))
    middle, low, high = (np.array(part) for part in zip(*rows, strict=True))
    return TwistScatter(drive, tuple(int(seed) for seed in seeds), torque, mean_twist, middle, low, high)
