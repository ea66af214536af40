"""A record of a catalogue gear with friction inside, and the fit of a set of effects to it."""

from __future__ import annotations

import numpy as np

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model import build_model
from reefmu.record import make_record, with_output_locked
from reefmu.simulate import simulate_record
from stiffness_model.io.drawing_toml import as_any_drive
from stiffness_model.kinds import AnyDrive

GEAR = as_any_drive("CHA-40A-50")
TRUE = {"hysteresis": {"torque": 4.0}}


def fitted_friction(
    twist: np.ndarray,
    output: np.ndarray | None,
    names: tuple[str, ...],
    *,
    locked: str = "crank",
    gear: AnyDrive = GEAR,
) -> tuple[Problem, Fit]:
    """A record of the gear with a hysteresis of 4 N.m, 20 s long, with a noise of 0.5 N.m, and the fit of a set.

    output: angle, rad, of a turning output; None for a record of the twist alone with a locked shaft. gear: against
    which the record is fitted.
    """
    time = 20 * np.arange(len(twist)) / len(twist)
    angle = -twist if output is None else output
    motion = {"time": time, "crank_angle": GEAR.ratio * (twist + angle), "output_angle": angle}
    torque = simulate_record(
        build_model(GEAR, TRUE, inherent=False), make_record(motion | {"output_torque": 0 * time}, "motion")
    )["measured.tau"] + 0.5 * np.random.default_rng(0).standard_normal(len(time))
    columns = {"time": time, "twist": twist} if output is None else motion
    record = make_record(columns | {"output_torque": torque}, "record")
    if locked == "output":
        record = with_output_locked(record, GEAR.ratio)
    trace = make_trace(record, gear.ratio)
    problem = prepare_problem(record, trace, BaseCurveSource(gear).base_curve(trace))
    start = {"hysteresis": [4.0, 5e-5], "coulomb_friction": [4.0, 5e-5], "stribeck_friction": [1.0, 1e-3, 2.0, 5e-5]}
    sizes = [start.get(name, [1e-9]) for name in names]
    return problem, problem.fit_from(names, np.concatenate([base_fit(problem).parameters, *sizes]))
