"""Effects that a record cannot tell apart are found from the record, whether the search fitted them or not."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.inference.alternatives import exchanges, indistinguishable_sets
from reefmu.diagnosis.inference.isolability import separating_experiments, separating_line
from tests.friction_record import fitted_friction

ONE_LOOP = 1.5e-3 * np.sin(2 * np.pi * np.arange(800) / 800)


@pytest.mark.parametrize("name", ["hysteresis", "coulomb_friction"])
def test_one_loop_does_not_show_where_the_friction_is(name: str) -> None:
    other = {"hysteresis": "coulomb_friction", "coulomb_friction": "hysteresis"}[name]
    problem, chosen = fitted_friction(ONE_LOOP, None, (name,))
    assert indistinguishable_sets(problem, chosen) == ((other,),)
    found = {e.fit.names: e for e in exchanges(problem, chosen)}
    assert found[other,].expected_gain < 1e-6 * found[other,].information, "the same torque, sample by sample"
    # Friction that grows with the speed or the load leaves a clear misfit, although it takes part of the loop.
    assert all(not e.is_indistinguishable for names, e in found.items() if names != (other,))


def test_a_set_of_three_is_ambiguous_although_no_search_fitted_its_rivals() -> None:
    """Such a set was named for one loop: coulomb_friction with stribeck_friction and preload."""
    problem, chosen = fitted_friction(ONE_LOOP, None, ("coulomb_friction", "stribeck_friction", "preload"))
    assert ("hysteresis", "preload", "stribeck_friction") in indistinguishable_sets(problem, chosen)


def test_records_that_separate_them_have_no_rivals() -> None:
    """An output that turns both ways under load, and one that is locked."""
    time = np.arange(800) / 40
    turning = 0.1 * np.sin(2 * np.pi * time / 5), 7e-4 + 5e-4 * np.sin(2 * np.pi * time / 3.1)
    assert indistinguishable_sets(*fitted_friction(turning[1], turning[0], ("hysteresis",))) == ()
    problem, chosen = fitted_friction(ONE_LOOP, None, ("hysteresis",), locked="output")
    assert "coulomb_friction" not in problem.candidates or indistinguishable_sets(problem, chosen) == ()


def test_a_pair_has_one_line_whichever_of_both_is_named_first() -> None:
    for first, second in (("hysteresis", "coulomb_friction"), ("backlash", "preload")):
        assert separating_line(first, second) == separating_line(second, first)
        assert separating_experiments([(first,), (second,)]) == [separating_line(second, first)]
