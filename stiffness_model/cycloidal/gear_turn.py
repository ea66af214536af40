"""One cycloidal drive with its own deviations as it turns: transmission error under load, play and position error.

The twist that carries a torque changes as the drive turns: output angle - crank angle/ratio = -twist is the
transmission error (VDI/VDE 2608; ISO/TR 10064-1). Pins and ring return after a turn of the disc, so that the pattern
repeats after one turn of the output.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..drawing.sampling import BLOCK
from ..drawing.twist_limits import twist_limit
from ..errors import InputError, expect, expect_number
from ..montecarlo.twist_torque_curve import BACKLASH_SHARE
from ..numerics.arrays import Array
from .cycloidal_drive import CycloidalDrive
from .gear_equilibrium import GearEquilibrium, solve_gears
from .part_deviations import PartDeviations, draw_deviations, without_deviations

N_TRIAL = 33
"""Twists within the limits between which the twist of a torque is sought first; chosen by judgement."""
MAX_STEPS = 60
"""Steps of the search for the twist; chosen by judgement, some six are usual."""
TOLERANCE = 1e-7
"""Error of the torque relative to that at max_twist; chosen by judgement, some ten times the solver's."""


@dataclass(frozen=True, eq=False)
class CycloidalIndividual:
    """One drive with its own deviations; seed: None for the drive as drawn."""

    drive: CycloidalDrive
    seed: int | None
    deviations: PartDeviations

    def at(self, crank_angle: Array, twist: Array) -> GearEquilibrium:
        """Equilibrium at crank angles (n,), rad, and twists (T,) or (n, T), rad."""
        return solve_gears(self.drive, self.deviations.at_angles(crank_angle), twist)


class GearTurn(NamedTuple):
    """An individual under one torque at n crank angles: twist, (n,) rad, and stiffness with the crank held, (n,)
    N.m/rad.
    """

    torque: float
    crank_angle: Array
    twist: Array
    stiffness: Array

    @property
    def transmission_error(self) -> Array:
        """Output angle - crank angle/ratio, (n,) rad, with the drive's wind-up under the torque."""
        return -self.twist


class GearNoLoad(NamedTuple):
    """Twists, (n,) rad, at which the drive carries +-`drag_torque`, N.m, at n crank angles."""

    drag_torque: float
    crank_angle: Array
    forward: Array
    backward: Array

    @property
    def play(self) -> Array:
        """Width of the backlash, (n,) rad."""
        return self.forward - self.backward

    @property
    def position_error(self) -> Array:
        """Transmission error in the middle of the backlash, (n,) rad."""
        return -(self.forward + self.backward) / 2


def draw_gear(drive: CycloidalDrive, seed: int | None) -> CycloidalIndividual:
    """The individual of a seed, the first drive of the population of that seed; None for the drive as drawn."""
    if seed is None:
        return CycloidalIndividual(drive, None, without_deviations(drive, np.zeros(1)))
    return CycloidalIndividual(drive, seed, draw_deviations(drive, 0, BLOCK, seed)[:1])


def crank_angles_over_turn(drive: CycloidalDrive, per_crank_turn: int = 16) -> Array:
    """Crank angles, rad, spread evenly over one turn of the output of a drive, (lobes * per_crank_turn,)."""
    count = drive.lobes * per_crank_turn
    return 2 * np.pi * drive.lobes * np.arange(count) / count


def gear_turn(individual: CycloidalIndividual, torque: float, crank_angle: ArrayLike) -> GearTurn:
    """Twist and stiffness of an individual under `torque`, N.m. crank_angle: (n,) rad.

    Raises `InputError` for a torque that no twist within `twist_limits.twist_limit` carries.
    """
    wanted = expect_number(torque, "a finite torque in N.m", "torque")
    angle = np.atleast_1d(np.asarray(crank_angle, float))
    expect(angle.ndim == 1 and bool(np.isfinite(angle).all()), "finite crank angles in rad", crank_angle, "crank angle")
    drive = individual.drive
    reach = twist_limit(drive)
    trial = np.linspace(-reach, reach, N_TRIAL)
    torques = individual.at(angle, trial).torque
    full = float(np.abs(np.interp(drive.max_twist, trial, torques.mean(0))))
    lowest, highest = float(torques[:, 0].max()), float(torques[:, -1].min())
    if not lowest < wanted < highest:
        raise InputError(
            f"torque: expected one within {lowest:.4g} ... {highest:.4g} N.m, what {drive.name} carries at every "
            f"angle, got {torque:.4g}"
        )
    # The last twist below the torque; the torque rises with the twist.
    place = np.clip((torques <= wanted).sum(1), 1, N_TRIAL - 1)
    rows = np.arange(len(angle))
    low, high = trial[place - 1], trial[place]
    below, above = torques[rows, place - 1], torques[rows, place]
    twist = low + (high - low) * (wanted - below) / np.maximum(above - below, 1e-300)
    for _ in range(MAX_STEPS):
        found = individual.at(angle, twist[:, None])
        gap, slope = found.torque[:, 0] - wanted, found.stiffness[:, 0]
        low, high = np.where(gap < 0, twist, low), np.where(gap > 0, twist, high)
        if bool((np.abs(gap) <= TOLERANCE * full).all()):
            break
        newton = twist - gap / np.where(slope > 0, slope, np.inf)
        inside = (newton > low) & (newton < high)
        twist = np.where(np.abs(gap) <= TOLERANCE * full, twist, np.where(inside, newton, (low + high) / 2))
    return GearTurn(wanted, angle, twist, found.stiffness[:, 0])  # pyright: ignore[reportPossiblyUnboundVariable]


def gear_no_load(individual: CycloidalIndividual, crank_angle: ArrayLike) -> GearNoLoad:
    """The individual under a drag torque of `BACKLASH_SHARE` of that at max_twist. crank_angle: (n,) rad."""
    angle = np.atleast_1d(np.asarray(crank_angle, float))
    full = float(individual.at(angle, np.array([individual.drive.max_twist])).torque.mean())
    expect(full > 0, "an individual that carries torque at max_twist", full, individual.drive.name)
    drag = BACKLASH_SHARE * full
    forward, backward = (gear_turn(individual, sense * drag, angle).twist for sense in (1, -1))
    return GearNoLoad(drag, angle, forward, backward)
