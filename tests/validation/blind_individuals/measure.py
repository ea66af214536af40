"""From true motion to what is written down: lag, filters, noise, quantisation, time stamps, the twist's zero."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stiffness_model.numerics.arrays import Array
from tests.validation.blind.forms import ar1, retarded
from tests.validation.blind.protocols import Schedule

from .catalogue import Case, Rig
from .contacts import MeanDrive
from .simulate import Motion

ARCMIN = np.pi / 180 / 60
FILTER = 5e-4
"""s, time constant of the filter that all channels share."""
THERMOMETER = 0.1
"""K, its step and its noise."""


def coloured(rng: np.random.Generator, starts: Array, correlation: float, mixed: float) -> Array:
    """Unit noise: an autoregressive part and a white one with a share `mixed` of the power."""
    return np.sqrt(1 - mixed) * ar1(rng, starts, correlation) + np.sqrt(mixed) * rng.standard_normal(int(starts[-1]))


def noise_parts(rig: Rig, mean: MeanDrive, motion: Motion) -> tuple[float, float]:
    """Rms of the torque's own noise, N.m, and of the output angle's, rad."""
    whole = rig.noise * mean.full_torque
    slope = float(np.sqrt(np.mean(motion.slope**2)))
    return whole * np.sqrt(1 - rig.of_angle), whole * np.sqrt(rig.of_angle) / slope


def measured(
    case: Case, mean: MeanDrive, test: Schedule, motion: Motion, rng: np.random.Generator
) -> tuple[dict[str, Array], Array]:
    """Columns of the record, and the noise (n,), N.m: what a perfect model of the drive would leave."""
    rig, starts = case.rig, test.starts
    torque_noise, angle_noise = noise_parts(rig, mean, motion)
    crank, output = retarded(np.array([motion.crank, motion.output]), test.time, starts, FILTER)
    torque = retarded(motion.torque, test.time, starts, FILTER + rig.lag)
    error = torque_noise * coloured(rng, starts, rig.correlation, rig.mixed)
    angle_error = angle_noise * coloured(rng, starts, 0.6 * rig.correlation, rig.mixed)
    # A step far above the noise would make another record of it: no rig of a laboratory is that coarse.
    torque_step = min(rig.torque_step * mean.full_torque, torque_noise)
    angle_step = min(rig.angle_step, 2 * angle_noise)
    read = _rounded(torque + error, torque_step)
    angle = _rounded(output + angle_error, angle_step) + rng.uniform(-0.2, 0.2) * mean.full_twist
    crank_step = min(2 * np.pi / 2**19, angle_noise * abs(mean.drive.ratio))
    step = np.diff(test.time, prepend=test.time[0])
    step[starts[:-1]] = 0.0
    stamps = np.maximum.accumulate(test.time + rig.jitter * step * np.clip(rng.standard_normal(len(step)), -3, 3))
    warm = _rounded(test.temperature + THERMOMETER * rng.standard_normal(len(step)), THERMOMETER)
    noise = read - torque + motion.slope * (_rounded(output + angle_error, angle_step) - output)
    return _columns(case, mean.drive.ratio, stamps, test, _rounded(crank, crank_step), angle, read, warm), noise


def _rounded(value: Array, step: float) -> Array:
    return step * np.round(value / step) if step > 0 else value


def _columns(
    case: Case, ratio: float, time: Array, test: Schedule, crank: Array, output: Array, torque: Array, warm: Array
) -> dict[str, Array]:
    table: dict[str, Array] = {"time [s]": time, "run": test.run}
    if "crank_angle" in case.missing:
        table["twist [arcmin]"] = (crank / ratio - output) / ARCMIN
    else:
        table |= {"crank_angle [rad]": crank, "output_angle [rad]": output}
    table |= {"output_torque [N.m]": torque, "temperature [degC]": warm}
    return {title: values for title, values in table.items() if title.split(" ")[0] not in case.missing}


def csv_text(table: Mapping[str, Array]) -> str:
    """The record's file: the contract's header and rows."""
    formats = ["%d" if title == "run" else "%.10g" for title in table]
    rows = np.stack(list(table.values()), axis=1)
    line = ",".join(formats)
    return "\n".join([",".join(table), *(line % tuple(row) for row in rows.tolist())]) + "\n"
