"""Notes on how a record was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reefmu.diagnosis.report.assemble import notes_on_friction
from reefmu.effects import IndependentVariable
from tests.friction_record import fitted_friction


def test_friction_that_is_built_up_when_runs_start_is_told_where_the_fit_has_it() -> None:
    problem, fit = fitted_friction(1.5e-3 * np.sin(2 * np.pi * np.arange(800) / 200), None, ("hysteresis",))
    assert notes_on_friction(problem, fit) == []
    friction = {IndependentVariable.TWIST: np.array([-0.25, 0.5])}
    started = replace(problem, trace=replace(problem.trace, friction=friction))
    (note,) = notes_on_friction(started, fit)
    assert "(hysteresis)" in note
    assert "-25 % and 50 %" in note
    assert notes_on_friction(started, problem.fit_from((), fit.parameters[: problem.layout(()).n_base])) == []
