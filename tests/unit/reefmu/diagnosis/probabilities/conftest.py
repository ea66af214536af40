"""A record of a catalogue gear with one loop of friction, and the fits of two sets to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model import build_model
from reefmu.record import make_record
from reefmu.simulate import simulate_record
from stiffness_model.io.drawing_toml import as_any_drive

GEAR = as_any_drive("CHA-40A-50")
NOISE = 0.5
"""N.m, standard deviation of the simulated noise."""


@dataclass(frozen=True)
class Fitted:
    """The problem of a record, its fit without effects and that of the hysteresis that is true, 4 N.m."""

    problem: Problem
    base: Fit
    hysteresis: Fit


@pytest.fixture(scope="session")
def fitted() -> Fitted:
    """Four loops of the gear with a locked crank; white noise."""
    phase = 2 * np.pi * np.arange(1600) / 400
    time, twist = np.arange(1600) / 40, 1.5e-3 * np.sin(phase)
    motion = {"time": time, "crank_angle": 0 * time, "output_angle": -twist, "output_torque": 0 * time}
    model = build_model(GEAR, {"hysteresis": {"torque": 4.0}}, inherent=False)
    torque = simulate_record(model, make_record(motion, "motion"))["measured.tau"]
    torque = torque + NOISE * np.random.default_rng(0).standard_normal(len(time))
    record = make_record({"time": time, "twist": twist, "output_torque": torque}, "record")
    trace = make_trace(record, GEAR.ratio)
    problem = prepare_problem(record, trace, BaseCurveSource(GEAR).base_curve(trace))
    base = base_fit(problem)
    start = np.concatenate([base.parameters, [4.0, 5e-5]])
    return Fitted(problem, base, problem.fit_from(("hysteresis",), start))
