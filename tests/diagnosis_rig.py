"""A simulated rig for the tests: a drawing, a protocol, and records of models with known effects."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from reefmu.record import Record, make_record
from reefmu.simulate import simulate_record
from stiffness_model import Drive, load_drive
from stiffness_model.numerics.arrays import Array

STEP = 0.05


@functools.cache
def drive() -> Drive:
    return load_drive("drive_1")


def _triangle(cycles: int, samples: int) -> Array:
    phase = np.arange(cycles * samples) / samples
    return 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))


def protocol(full: bool = True, oversampling: int = 1) -> Record:
    """A record without torque: loops of two amplitudes at four crank angles, fast and slow loops, a hold and rotation
    in both senses; or, unless `full`, one loop. oversampling: samples for each sample of the usual record of 4240.
    """
    top = drive().max_twist
    parts: list[tuple[Array, Array, float, float]] = []
    if full:
        for angle in (0.3, 1.9, 3.4, 5.0):
            parts += [(np.full(240, angle), a * top * _triangle(2, 120), 20.0, STEP) for a in (0.35, 0.9)]
        parts += [(np.full(240, 0.3), 0.8 * top * _triangle(2, 120), 20.0, step) for step in (0.005, 0.5)]
        hold = np.concatenate([np.linspace(0, 0.8, 30), np.full(300, 0.8), np.linspace(0.8, 0, 30), np.zeros(200)])
        parts.append((np.full(560, 0.3), hold * top, 20.0, 0.1))
        ramp = np.clip(np.arange(260) / 30, 0, 1)
        for speed in (0.4, -0.4, 6.0, -6.0):
            turning = 0.3 + speed * STEP * np.maximum(np.arange(260) - 30, 0)
            parts.append((turning, 0.5 * top * ramp * (1 if abs(speed) < 1 else -1), 20.0, STEP))
        parts.append((np.full(240, 0.3), 0.8 * top * _triangle(2, 120), 45.0, STEP))
    else:
        parts.append((np.full(600, 0.3), 0.9 * top * _triangle(3, 200), 20.0, STEP))
    data: dict[str, list[Array]] = {name: [] for name in ("time", "run", "crank_angle", "output_angle", "temperature")}
    clock = 0.0
    for number, (crank, twist, temperature, step) in enumerate(parts):
        fine, coarse = np.arange(len(twist) * oversampling) / oversampling, np.arange(len(twist))
        crank, twist = (np.asarray(np.interp(fine, coarse, values), float) for values in (crank, twist))
        step = step / oversampling
        data["time"].append(clock + step * np.arange(len(twist)))
        data["run"].append(np.full(len(twist), float(number)))
        data["crank_angle"].append(crank)
        data["output_angle"].append(crank / drive().ratio - twist)
        data["temperature"].append(np.full(len(twist), temperature))
        clock = float(data["time"][-1][-1]) + 10.0
    columns = {name: np.concatenate(values) for name, values in data.items()}
    return make_record({**columns, "output_torque": np.zeros(len(columns["time"]))})


def noise_of(n: int, size: float, correlation: float, seed: int) -> Array:
    """First-order autoregressive noise of standard deviation `size`."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal(n + 500)
    return size * lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)[500:]


def measured(
    effects: Mapping[str, Mapping[str, float]],
    noise: float = 0.6,
    correlation: float = 0.5,
    seed: int = 0,
    full: bool = True,
) -> Record:
    """A simulated measurement of a drive with these effects; noise: N.m, its standard deviation."""
    record = protocol(full)
    model = build_model(drive(), effects, lookup=cached_lookup(drive()))
    torque = simulate_record(model, record)["measured.tau"]
    return replace(record, output_torque=torque + noise_of(len(record), noise, correlation, seed))
