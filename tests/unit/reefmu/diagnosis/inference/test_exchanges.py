"""Effects that a record cannot tell apart are found from the record, whether the search fitted them or not."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.inference.exchanges import exchanged_fits
from tests.friction_record import fitted_friction

ONE_LOOP = 1.5e-3 * np.sin(2 * np.pi * np.arange(800) / 800)


def differences(problem: Problem, chosen: Fit) -> dict[tuple[str, ...], float]:
    """By how much each set with an effect exchanged costs more, in -2 log likelihood."""
    return {tuple(sorted(fit.names)): fit.cost - chosen.cost for fit in exchanged_fits(problem, chosen)}


@pytest.mark.parametrize("name", ["hysteresis", "coulomb_friction"])
def test_one_loop_does_not_show_where_the_friction_is(name: str) -> None:
    other = {"hysteresis": "coulomb_friction", "coulomb_friction": "hysteresis"}[name]
    found = differences(*fitted_friction(ONE_LOOP, None, (name,)))
    assert found[other,] == pytest.approx(0.0, abs=0.1), "the same torque, sample by sample"
    # Friction that grows with the speed or the load leaves a clear misfit, although it takes part of the loop.
    assert all(cost > 9.0 for names, cost in found.items() if names != (other,))


def test_a_set_of_three_has_rivals_that_no_search_fitted() -> None:
    """Such a set was named for one loop: coulomb_friction with preload and another friction."""
    problem, chosen = fitted_friction(ONE_LOOP, None, ("coulomb_friction", "damping", "preload"))
    assert differences(problem, chosen)["damping", "hysteresis", "preload"] < 9.0


def test_records_that_separate_them_have_no_rivals() -> None:
    """An output that turns both ways under load, and one that is locked."""
    time = np.arange(800) / 40
    turning = 0.1 * np.sin(2 * np.pi * time / 5), 7e-4 + 5e-4 * np.sin(2 * np.pi * time / 3.1)
    assert all(cost > 9.0 for cost in differences(*fitted_friction(turning[1], turning[0], ("hysteresis",))).values())
    problem, chosen = fitted_friction(ONE_LOOP, None, ("hysteresis",), locked="output")
    assert "coulomb_friction" not in problem.candidates or not differences(problem, chosen)
