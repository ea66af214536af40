"""Effects that a record cannot tell apart are found from the record, whether the search fitted them or not."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.inference.alternatives import exchanges, indistinguishable_sets
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model import build_model
from reefmu.record import make_record, with_output_locked
from reefmu.simulate import simulate_record
from stiffness_model.io.drawing_toml import as_any_drive

GEAR = as_any_drive("CHA-40A-50")
TRUE = {"hysteresis": {"torque": 4.0}}
ONE_LOOP = 1.5e-3 * np.sin(2 * np.pi * np.arange(800) / 800)


def fitted(
    twist: np.ndarray, output: np.ndarray | None, names: tuple[str, ...], *, locked: str = "crank"
) -> tuple[Problem, Fit]:
    """A record of the gear with a hysteresis of 4 N.m, 20 s long, with a noise of 0.5 N.m, and the fit of a set.

    output: angle, rad, of a turning output; None for a record of the twist alone with a locked shaft.
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
    trace = make_trace(record, GEAR.ratio)
    problem = prepare_problem(record, trace, BaseCurveSource(GEAR).base_curve(trace))
    start = {"hysteresis": [4.0, 5e-5], "coulomb_friction": [4.0, 5e-5], "stribeck_friction": [1.0, 1e-3, 5e-5]}
    sizes = [start.get(name, [1e-9]) for name in names]
    return problem, problem.fit_from(names, np.concatenate([base_fit(problem).parameters, *sizes]))


@pytest.mark.parametrize("name", ["hysteresis", "coulomb_friction"])
def test_one_loop_does_not_show_where_the_friction_is(name: str) -> None:
    other = {"hysteresis": "coulomb_friction", "coulomb_friction": "hysteresis"}[name]
    problem, chosen = fitted(ONE_LOOP, None, (name,))
    assert indistinguishable_sets(problem, chosen) == ((other,),)
    found = {e.fit.names: e for e in exchanges(problem, chosen)}
    assert found[other,].expected_gain < 1e-6 * found[other,].information, "the same torque, sample by sample"
    # Friction that grows with the speed or the load leaves a clear misfit, although it takes part of the loop.
    assert all(not e.is_indistinguishable for names, e in found.items() if names != (other,))


def test_a_set_of_three_is_ambiguous_although_no_search_fitted_its_rivals() -> None:
    """Such a set was named for one loop: coulomb_friction with stribeck_friction and preload."""
    problem, chosen = fitted(ONE_LOOP, None, ("coulomb_friction", "stribeck_friction", "preload"))
    assert ("hysteresis", "preload", "stribeck_friction") in indistinguishable_sets(problem, chosen)


def test_records_that_separate_them_have_no_rivals() -> None:
    """An output that turns both ways under load, and one that is locked."""
    time = np.arange(800) / 40
    turning = 0.1 * np.sin(2 * np.pi * time / 5), 7e-4 + 5e-4 * np.sin(2 * np.pi * time / 3.1)
    assert indistinguishable_sets(*fitted(turning[1], turning[0], ("hysteresis",))) == ()
    problem, chosen = fitted(ONE_LOOP, None, ("hysteresis",), locked="output")
    assert "coulomb_friction" not in problem.candidates or indistinguishable_sets(problem, chosen) == ()
