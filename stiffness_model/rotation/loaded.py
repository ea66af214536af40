"""A turn under constant torque: transmission error, stiffness, and the position without load.

The twist that carries a torque changes as the drive turns: with the crank driven uniformly, the output leads and lags.
This is the transmission error (VDI/VDE 2608; ISO/TR 10064-1: tangential composite deviation):
output angle - crank angle/ratio = -twist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..display import one_line
from ..drawing.twist_limits import twist_limit
from ..errors import InputError, expect, expect_number
from ..montecarlo.twist_torque_curve import BACKLASH_SHARE
from ..numerics.arrays import Array
from .element_positions import low_discrepancy_angles
from .individual_drive import Individual
from .maps import AngleBatch, angle_batches, expect_angles, turning_map

TOLERANCE = 1e-8
"""Convergence tolerance of the torque as a share of the torque at the drawing's max_twist."""
_N_TWISTS = 41
_N_ANGLES = 48
_MAX_STEPS = 100


@dataclass(frozen=True)
class LoadedTurn:
    """An individual under one torque, N.m, at n output angles: twist, (n,) rad, and stiffness, (n,) N.m/rad."""

    individual: Individual
    torque: float
    output_angle: Array
    twist: Array
    stiffness: Array

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def transmission_error(self) -> Array:
        """Output angle - crank angle/ratio, (n,) rad, with the drive's wind-up under the torque."""
        return -self.twist


@dataclass(frozen=True)
class NoLoad:
    """Transmission errors, (n,) rad, of an individual without load at n output angles.

    forward, backward: the output is dragged by a crank that drives it towards larger and towards smaller output angles,
    against a drag torque of `drag_torque` N.m, `twist_torque_curve.BACKLASH_SHARE` of the torque at max_twist.
    """

    individual: Individual
    drag_torque: float
    output_angle: Array
    forward: Array
    backward: Array

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def position_error(self) -> Array:
        """The middle of the backlash, (n,) rad."""
        return (self.forward + self.backward) / 2

    @property
    def play(self) -> Array:
        """Width of the backlash, (n,) rad; close to zero for a preloaded drive."""
        return self.backward - self.forward


def loaded_turn(individual: Individual, torque: float, output_angle: ArrayLike) -> LoadedTurn:
    """The twist of an individual under `torque`, N.m, and its stiffness there.

    individual: see `draw_individual`. output_angle: (n,) rad. Raises `InputError` for a torque that no twist within
    `twist_limits.twist_limit` carries.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> from stiffness_model.rotation import draw_individual
    >>> loaded = loaded_turn(draw_individual(load_drive("drive_1"), 7), 150.0, [0.0, 0.1, 0.2])
    >>> bool((abs(loaded.twist / ARCMIN - 5.3) < 0.6).all())
    True
    """
    expect_number(torque, "a finite torque in N.m", "torque")
    angle = expect_angles(output_angle, "output angle")
    guess = _InitialGuess.for_torque(individual, float(torque))
    twist, slope = np.empty(len(angle)), np.empty(len(angle))
    step = 1e-4 * individual.drive.max_twist
    for part, batch in angle_batches(individual, angle):
        at = twist[part] = _twist_under(batch, guess)
        slope[part] = (batch.torque(at + step) - batch.torque(at - step)) / (2 * step)
    return LoadedTurn(individual, float(torque), angle, twist, slope)


def no_load(individual: Individual, output_angle: ArrayLike) -> NoLoad:
    """The `individual` without load at `output_angle`, (n,) rad, driven in either direction."""
    angle = expect_angles(output_angle, "output angle")
    full = float(turning_map(individual, [individual.drive.max_twist], low_discrepancy_angles(_N_ANGLES)).torque.mean())
    expect(full > 0, "an individual that carries torque at max_twist", full, individual.drive.name)
    drag_torque = BACKLASH_SHARE * full
    errors = np.empty((2, len(angle)))
    guesses = [_InitialGuess.for_torque(individual, torque) for torque in (drag_torque, -drag_torque)]
    for part, batch in angle_batches(individual, angle):
        errors[:, part] = [-_twist_under(batch, guess) for guess in guesses]
    return NoLoad(individual, drag_torque, angle, *errors)


@dataclass(frozen=True)
class _InitialGuess:
    """Initial guess for the twist of a torque, from the mean over some angles."""

    torque: float
    twist: float
    slope: float
    reach: float
    tolerance: float

    @staticmethod
    def for_torque(individual: Individual, torque: float) -> _InitialGuess:
        """The guess for a torque, N.m. Raises `InputError` for a torque out of range."""
        reach = twist_limit(individual.drive)
        trial = np.linspace(-reach, reach, _N_TWISTS)
        mean = turning_map(individual, trial, low_discrepancy_angles(_N_ANGLES)).torque.mean(axis=0)
        if not mean[0] < torque < mean[-1]:
            raise InputError(
                f"torque: expected one within {mean[0]:.4g} ... {mean[-1]:.4g} N.m, what "
                f"{individual.drive.name} carries, got {torque:.4g}"
            )
        k = int(np.clip(np.searchsorted(mean, torque), 1, _N_TWISTS - 1))
        slope = float((mean[k] - mean[k - 1]) / (trial[k] - trial[k - 1]))
        full = float(np.interp(individual.drive.max_twist, trial, mean))
        return _InitialGuess(
            torque, float(trial[k - 1] + (torque - mean[k - 1]) / slope), slope, reach, TOLERANCE * full
        )


def _twist_under(batch: AngleBatch, guess: _InitialGuess) -> Array:
    """The twist, (n,) rad, that carries the torque at every angle of a batch, by secant steps within a shrinking
    bracket.

    Where the torque jumps across the required value (an element changes its wall), the twist of the jump.
    """
    n = len(batch.positions.beta)
    low, high = np.full(n, -guess.reach), np.full(n, guess.reach)
    twist, slope = np.full(n, guess.twist), np.full(n, guess.slope)
    value = batch.torque(twist)
    last_width = high - low
    for k in range(_MAX_STEPS):
        gap = value - guess.torque
        low, high = np.where(gap < 0, twist, low), np.where(gap > 0, twist, high)
        width = high - low
        unconverged = (np.abs(gap) > guess.tolerance) & (width > 1e-13)
        if not unconverged.any():
            break
        step = twist - gap / slope
        # Every third step bisects a bracket that the secants shrink from one side only.
        accepted = (step > low) & (step < high) & ((k % 3 != 2) | (width < last_width / 4))
        if k % 3 == 2:
            last_width = width
        new = np.where(unconverged, np.where(accepted, step, (low + high) / 2), twist)
        found = batch.torque(new)
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = (found - value) / (new - twist)
        slope = np.where(np.isfinite(secant) & (secant > 0), secant, slope)
        twist, value = new, found
    return twist
