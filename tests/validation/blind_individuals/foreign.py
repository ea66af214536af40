"""What has no name in the diagnosis' vocabulary, in kinds with sizes that rigs and parts make plausible."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array
from tests.validation.blind.forms import rate, retarded
from tests.validation.blind.protocols import Schedule

Added = tuple[Array | float, Array | float]
"""Torque, N.m, and twist, rad, that a kind adds."""


@dataclass(frozen=True)
class Foreign:
    """One kind with its size, in the unit of `KINDS`, and a free number in 0 ... 1 for a phase, a place or a sign."""

    kind: str
    size: float
    number: float


@dataclass(frozen=True)
class Scene:
    """What a kind may look at: the schedule; contact twist, cage angle, rad; elastic torque, N.m; twist, rad; full
    torque and twist; stiffness of the contacts, N.m/rad."""

    test: Schedule
    contact: Array
    cage: Array
    elastic: Array
    twist: Array
    full: float
    full_twist: float
    slope: Array

    @property
    def direction(self) -> Array:
        """Direction of the twist, -1 to 1, that turns over within some samples of a loop."""
        step = rate(self.twist, self.test.time, self.test.starts)
        typical = np.median(np.abs(step[np.abs(step) > 0])) if np.any(step) else 1.0
        return np.tanh(step / (0.1 * typical))

    @property
    def load(self) -> Array:
        """Elastic torque over full torque."""
        return self.elastic / self.full


def _warm(s: Scene) -> Array:
    return (s.test.temperature - 20.0) / 30.0


def _since(s: Scene, moving: Array) -> Array:
    """Seconds since the last sample of a run that was moving, 0 while it moves."""
    out, last, fresh = np.zeros(len(moving)), 0.0, set(s.test.starts.tolist())
    for k, time in enumerate(s.test.time.tolist()):
        if moving[k] or k in fresh:
            last = time
        out[k] = time - last
    return out


def _greatest_so_far(s: Scene) -> Array:
    """Greatest load of the record so far, over full torque."""
    return np.maximum.accumulate(np.abs(s.load))


def _warm_friction(s: Scene, size: float, number: float) -> Added:
    return size * s.full * _warm(s) * s.direction, 0.0


def _clamp_slip(s: Scene, size: float, number: float) -> Added:
    # The clamp gives way at the first peak after some part of the record, within a run.
    able = np.flatnonzero((np.abs(s.load) > 0.6) & (np.arange(len(s.load)) > (0.1 + 0.5 * number) * len(s.load)))
    if not len(able):
        return 0.0, 0.0
    after = np.arange(len(s.load)) >= able[0]
    return 0.0, size * s.full_twist * after * np.sign(s.load[able[0]])


def _loosening(s: Scene, size: float, number: float) -> Added:
    # Virgin parts are stiffer: what was never loaded so far has not bedded in yet.
    return 0.0, size * s.full_twist * s.load * (_greatest_so_far(s) - 0.5)


def _cracked_lobe(s: Scene, size: float, number: float) -> Added:
    # One lobe gives: felt while the row's elements pass it, once per pitch of the cage, at one place of the crank.
    phase = np.mod(s.test.crank / (2 * np.pi) + number + 0.5, 1.0) - 0.5
    return -size * s.elastic * np.exp(-((phase / 0.02) ** 2)), 0.0


def _sticking(s: Scene, size: float, number: float) -> Added:
    speed = np.abs(rate(s.twist, s.test.time, s.test.starts))
    moving = speed > 1e-3 * s.full_twist / 10
    rested = _since(s, moving)
    # What has rested for long breaks away with a peak that decays over the way.
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s.twist)))])
    out, peak, start = np.zeros(len(way)), 0.0, 0.0
    for k in range(len(way)):
        if rested[k] > 5.0:
            peak, start = 1 - np.exp(-rested[k] / 30.0), way[k]
        out[k] = peak * np.exp(-(way[k] - start) / (0.15 * s.full_twist)) * moving[k]
    return size * s.full * out * s.direction, 0.0


def _output_order(s: Scene, size: float, number: float) -> Added:
    # A sensor that sits askew answers to the load by where the output stands.
    return size * s.elastic * np.sin(s.cage + 2 * np.pi * number), 0.0


def _motor_slots(s: Scene, size: float, number: float) -> Added:
    return size * s.full * np.sin((24 if number < 0.5 else 36) * s.test.crank + 4 * np.pi * number), 0.0


def _inertia(s: Scene, size: float, number: float) -> Added:
    output = s.cage + s.contact - s.twist
    speed = rate(output, s.test.time, s.test.starts)
    change = rate(retarded(speed, s.test.time, s.test.starts, 0.01), s.test.time, s.test.starts)
    return -size * change, 0.0


def _grease(s: Scene, size: float, number: float) -> Added:
    # Grease is pushed aside over some turns of every run.
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s.test.crank)))])
    starts = s.test.starts[:-1]
    own = travel - np.repeat(travel[starts], np.diff(s.test.starts))
    turning = np.tanh(rate(s.test.crank, s.test.time, s.test.starts) / 0.1)
    return -size * s.full * turning * np.exp(-own / (2 + 6 * number)), 0.0


def _coupling_play(s: Scene, size: float, number: float) -> Added:
    return 0.0, size * s.full_twist * np.tanh(s.load / 0.04)


def _flank(s: Scene, size: float, number: float) -> Added:
    return (size if number < 0.5 else -size) * np.maximum(s.elastic, 0.0), 0.0


def _warm_modulus(s: Scene, size: float, number: float) -> Added:
    return -size * _warm(s) * s.elastic, 0.0


def _lobed_stiffness(s: Scene, size: float, number: float) -> Added:
    return size * s.elastic * np.sin((2 if number < 0.5 else 3) * s.test.crank + 4 * np.pi * number), 0.0


def _floor_swing(s: Scene, size: float, number: float) -> Added:
    period = 7.0 + 30.0 * number
    return size * s.full * np.sin(2 * np.pi * s.test.time / period), 0.0


def _regained(s: Scene, size: float, number: float) -> Added:
    # The amplifier was set anew between two runs.
    runs = s.test.run.max()
    later = s.test.run > 1 + np.floor((runs - 1) * (0.25 + 0.5 * number))
    return size * s.elastic * later, 0.0


def _lag(s: Scene, size: float, number: float) -> Added:
    return retarded(s.elastic, s.test.time, s.test.starts, size) - s.elastic, 0.0


@dataclass(frozen=True)
class Kind:
    """add: the form; low, high: range of sizes; family: whether the diagnosis held an anonymous family that
    takes it when this catalogue was written."""

    add: Callable[[Scene, float, float], Added]
    low: float
    high: float
    family: bool


KINDS: Mapping[str, Kind] = {
    "warm_friction": Kind(_warm_friction, 0.02, 0.06, False),
    "coupling_play": Kind(_coupling_play, 0.02, 0.06, True),
    "clamp_slip": Kind(_clamp_slip, 0.01, 0.05, False),
    "flank": Kind(_flank, 0.04, 0.12, True),
    "loosening": Kind(_loosening, 0.04, 0.12, False),
    "warm_modulus": Kind(_warm_modulus, 0.04, 0.12, True),
    "cracked_lobe": Kind(_cracked_lobe, 0.1, 0.3, False),
    "lobed_stiffness": Kind(_lobed_stiffness, 0.04, 0.1, True),
    "sticking": Kind(_sticking, 0.02, 0.06, False),
    "floor_swing": Kind(_floor_swing, 0.008, 0.03, True),
    "motor_slots": Kind(_motor_slots, 0.008, 0.03, False),
    "regained": Kind(_regained, 0.04, 0.1, True),
    "output_order": Kind(_output_order, 0.04, 0.1, False),
    "lag": Kind(_lag, 0.004, 0.03, True),
    "inertia": Kind(_inertia, 0.2, 1.0, False),
    "grease": Kind(_grease, 0.02, 0.06, False),
}
"""Sizes as shares of full torque or full twist, but for the lag, s, and the inertia, kg.m^2."""


def added(foreign: Foreign, scene: Scene) -> Added:
    """What the effect adds to torque and twist, N.m and rad."""
    return KINDS[foreign.kind].add(scene, foreign.size, foreign.number)
