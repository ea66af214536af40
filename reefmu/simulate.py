"""Simulation of a drive model over a signal or a measured record."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.numerics.arrays import Array
from stiffness_model.units import REFERENCE_TEMPERATURE

from .model.drive_model import DriveModel
from .model.signals import CONTACT_LOADS, INPUTS
from .record import Record
from .speed import central_speed


@dataclass(frozen=True)
class Response:
    """Response of a model over n samples: time (n,) s, outputs (n, n_outputs) in the order of `names`, those of
    `DriveModel.outputs`, states (n, n_states). lacks: `DriveModel.lacks`."""

    time: Array
    outputs: Array
    states: Array
    names: tuple[str, ...]
    lacks: str = ""

    def __getitem__(self, name: str) -> Array:
        """One output over time, (n,), by its name ("output.tau"). Raises `UnknownNameError`, or `InputError` for an
        output that the model lacks."""
        if name not in self.names:
            if self.lacks and name in CONTACT_LOADS:
                raise InputError(self.lacks)
            raise unknown_name("output", name, self.names)
        return self.outputs[:, self.names.index(name)]


def simulate_signal(model: DriveModel, time: ArrayLike, inputs: ArrayLike, start: ArrayLike | None = None) -> Response:
    """The model's response to a signal.

    time: (n,) s, not decreasing; inputs: (n, 5) in the order of `INPUTS`. start: initial states (n_states,); else
    consistent with the first sample. Before each sample an input already has its new value, as in the FMU. Raises
    `InputError` for other shapes, decreasing times and values that are not finite.
    """
    t, u = np.asarray(time, float), np.asarray(inputs, float)
    expect(t.ndim == 1 and len(t) > 0 and bool((np.diff(t) >= 0).all()), "times that do not decrease", t, "time")
    expect(u.shape == (len(t), len(INPUTS)), f"inputs of shape ({len(t)}, {len(INPUTS)})", u.shape, "inputs")
    expect(bool(np.isfinite(u).all() and np.isfinite(t).all()), "finite inputs and times", "nan or inf", "inputs")
    p = model.parameter_vector()
    steps = np.diff(t, prepend=t[0])
    n_states = len(model.states)
    if n_states == 0:
        states = np.zeros((len(t), 0))
    else:
        first = np.array(model.initial(u[0], p)) if start is None else np.asarray(start, float)
        states = np.array(_trajectory(model, len(t))(first, u.T, steps, p)).T.reshape(len(t), n_states)
    outputs = np.array(model.output.map(len(t))(states.T, u.T, ca.repmat(ca.DM(p), 1, len(t)))).T
    return Response(t, outputs, states, tuple(signal.name for signal in model.outputs), model.lacks)


def _trajectory(model: DriveModel, n: int) -> ca.Function:
    """(x0, u (5, n), dt (1, n), p) -> states (n_states, n)."""
    x, u, dt, p = (
        ca.MX.sym(name, size)
        for name, size in (("x", len(model.states)), ("u", len(INPUTS)), ("dt", 1), ("p", len(model.parameters)))
    )
    step = ca.Function("step", [x, u, dt, p], [model.advance(x, u, dt, p)])
    chain = step.mapaccum(n)
    start, us, dts = ca.MX.sym("x0", len(model.states)), ca.MX.sym("us", len(INPUTS), n), ca.MX.sym("dts", 1, n)
    return ca.Function("trajectory", [start, us, dts, p], [chain(start, us, dts, ca.repmat(p, 1, n))])


def record_inputs(record: Record) -> Array:
    """Inputs (n, 5) of a record in the order of `INPUTS`; without measured speeds they are central differences within
    each run.
    """
    crank, output = record.crank_angle, record.output_angle
    speeds = record.speeds
    if speeds is None:
        runs = [slice(first, last) for first, last in itertools.pairwise([*record.starts, len(record)])]
        speeds = np.stack(
            [
                np.concatenate([central_speed(angle[run], record.time[run]) for run in runs])
                for angle in (crank, output)
            ],
            axis=1,
        )
    return np.stack([crank, speeds[:, 0], output, speeds[:, 1], record.temperature], axis=1)


def simulate_record(model: DriveModel, record: Record) -> Response:
    """The model's response to every run of a record. States restart with each run, except those that never reset.

    For these the pause between two runs is one long step, over the time that has passed, and over the difference of the
    crank angle, which is the least that the crank has moved. A clock that starts again adds no time.
    """
    inputs = record_inputs(record)
    parts: list[Response] = []
    for first, last in itertools.pairwise([*record.starts, len(record)]):
        start = None
        if parts and not model.resets.all():
            pause = max(record.time[first] - record.time[first - 1], 0.0)
            start = _next_start(model, parts[-1].states[-1], inputs[first], pause)
        parts.append(simulate_signal(model, record.time[first:last], inputs[first:last], start))
    return replace(
        parts[0],
        time=record.time,
        outputs=np.concatenate([p.outputs for p in parts]),
        states=np.concatenate([p.states for p in parts]),
    )


def _next_start(model: DriveModel, states: Array, inputs: Array, pause: float) -> Array:
    """States at the start of a run: initial ones, or continued over the pause (s) before it."""
    p = model.parameter_vector()
    initial = np.array(model.initial(inputs, p)).ravel()
    continued = np.array(model.advance(states, inputs, pause, p)).ravel()
    return np.where(model.resets, initial, continued)


def inputs_at_twist(twist: ArrayLike, model: DriveModel, crank_angle: ArrayLike = 0.0) -> Array:
    """Inputs (n, 5) at rest for these twists, rad, at these crank angles, rad."""
    t = np.atleast_1d(np.asarray(twist, float))
    crank = np.broadcast_to(np.asarray(crank_angle, float), t.shape)
    ratio = model.parameters[0].value
    zeros = np.zeros_like(t)
    return np.stack([crank, zeros, crank / ratio - t, zeros, np.full_like(t, REFERENCE_TEMPERATURE)], axis=1)
