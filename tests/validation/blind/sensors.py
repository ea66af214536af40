"""From true motion to measured values: filters, sampling jitter, noise, quantisation, zero of the twist."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from . import forms
from .elements import Array
from .plant import Motion
from .protocols import Schedule
from .tables import Tables

FILTER = 5e-4
"""Time constant, s, of the filter of all channels; chosen by judgement."""
MISMATCH = 0.02
"""Greatest relative difference of the torque channel's filter from that of the angles; chosen by judgement."""


@dataclass(frozen=True)
class Sensors:
    """Properties of the sensors. noise: rms of the whole noise as torque, over full torque; correlation: of
    neighbouring samples; of_angle: share of the noise's variance that comes from the output angle; jitter: of the time
    stamps, over the time step; torque_delay: s, by which the torque is read late.
    """

    noise: float = 0.003
    correlation: float = 0.0
    of_angle: float = 0.2
    jitter: float = 0.02
    torque_delay: float = 0.0


@dataclass(frozen=True)
class Reading:
    """Measured channels, (n,), in the units of `Schedule` and `Motion`. noise: residual of a
    perfect model, N.m: error of the torque plus stiffness times error of the output angle.
    """

    time: Array
    crank: Array
    output: Array
    torque: Array
    temperature: Array
    noise: Array


def read(tables: Tables, test: Schedule, motion: Motion, sensors: Sensors, rng: np.random.Generator) -> Reading:
    """Measure a motion. The output's zero is arbitrary."""
    starts, full = test.starts, tables.full_torque
    crank, output = forms.retarded(np.array([motion.crank, motion.output]), test.time, starts, FILTER)
    torque = forms.retarded(motion.torque, test.time, starts, FILTER * (1 + rng.uniform(-1, 1) * MISMATCH))
    if sensors.torque_delay:
        runs = itertools.pairwise(starts)
        late = [np.interp(test.time[a:b] - sensors.torque_delay, test.time[a:b], torque[a:b]) for a, b in runs]
        torque = np.concatenate(late)
    torque_noise = sensors.noise * full * np.sqrt(1 - sensors.of_angle)
    slope = np.sqrt(np.mean(motion.stiffness**2))
    angle_noise = sensors.noise * full * np.sqrt(sensors.of_angle) / slope
    torque_error = _measured(torque, torque_noise, sensors.correlation, starts, rng) - torque
    # The noise of encoders has a shorter correlation time than that of a torque sensor's amplifier.
    angle_error = _measured(output, angle_noise, 0.6 * sensors.correlation, starts, rng) - output
    zero = rng.uniform(-0.2, 0.2) * tables.full_twist
    crank_step = max(angle_noise, 1e-7) * abs(tables.drive.ratio) / 10
    temperature = test.temperature + 0.1 * rng.standard_normal(len(crank))
    return Reading(
        time=_stamps(test, sensors.jitter, rng),
        crank=_rounded(crank, crank_step),
        output=output + angle_error + zero,
        torque=torque + torque_error,
        temperature=_rounded(temperature, 0.1),
        noise=torque_error + motion.stiffness * angle_error,
    )


def _measured(value: Array, noise: float, correlation: float, starts: Array, rng: np.random.Generator) -> Array:
    """A value with noise, quantised to half of the noise's standard deviation."""
    if noise == 0:
        return value
    return _rounded(value + noise * forms.ar1(rng, starts, correlation), 0.5 * noise)


def _rounded(value: Array, step: float) -> Array:
    return step * np.round(value / step)


def _stamps(test: Schedule, jitter: float, rng: np.random.Generator) -> Array:
    """Time stamps with jitter, not decreasing."""
    step = np.diff(test.time, prepend=test.time[0])
    step[test.starts[:-1]] = 0.0
    stamps = test.time + jitter * step * np.clip(rng.standard_normal(len(step)), -3, 3)
    return np.maximum.accumulate(stamps)
