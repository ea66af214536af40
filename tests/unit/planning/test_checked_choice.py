"""The choice of motions goes on until records name every effect, the time is used up, or no run would help."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from reefmu.diagnosis.calibrated_odds import NAMED, log_odds
from reefmu.diagnosis.discrimination.predicted_isolability import isolability
from reefmu.diagnosis.discrimination.simulated_scores import gaussian_scores
from reefmu.planning.checked_choice import Choice, Ended, choose_protocol
from reefmu.planning.design import Candidates, wanted_separations
from reefmu.planning.information import total_information
from reefmu.planning.protocols.schedule import Schedule
from reefmu.planning.setting import Checked, Setting

SETS = (("structural_compliance",), ("hysteresis",))
"""A spring and a friction, of which one motion shows enough."""
UNIT = wanted_separations(0.9)[0] / 105.0
"""Share of the information of the library of which all motions separate the spring 2.5 times as far as a name takes."""


Choose = Callable[[float, float], Choice]


@pytest.fixture(scope="session")
def choose(setting: Setting) -> Choose:
    """The choice by minutes of the rig and by the information that records hold, over `UNIT` of that of the library;
    each is computed once."""
    return cache(partial(_choose, setting))


def _choose(setting: Setting, minutes: float, kept: float, sets: Sequence[tuple[str]] = SETS) -> Choice:
    rig = replace(setting.rig, minutes=minutes)
    candidates: Candidates = setting.candidates(rig, sets, sets)

    def check(schedule: Schedule) -> Checked:
        share = kept * UNIT
        information = share * total_information(candidates.pieces, schedule)
        found = isolability(gaussian_scores(information, 100, 0), candidates.true, candidates.rivals)
        return Checked(found, tuple(share * part for part in candidates.found(schedule.chosen)[1]))

    return choose_protocol(candidates, check, lambda stage, share: None, 0.9)


@pytest.mark.slow
def test_a_choice_goes_on_until_records_name_every_effect(choose: Choose) -> None:
    easy, hard = choose(30.0, 1.0), choose(30.0, 0.6)
    assert (easy.ended, hard.ended) == (Ended.REACHED, Ended.REACHED)
    assert min(easy.checked.named_right()) >= 0.9
    assert min(hard.checked.named_right()) >= 0.9
    assert hard.schedule.seconds > easy.schedule.seconds


@pytest.mark.slow
@pytest.mark.xfail(
    reason="all motions of the rig separate a clearance of one tolerance by 5.4 standard deviations, and a name takes "
    "5.2: individuals differ by as much",
    strict=True,
)
def test_a_choice_reaches_a_clearance_of_typical_size(setting: Setting) -> None:
    assert _choose(setting, 30.0, 1.0, (("backlash",), ("hysteresis",))).ended is Ended.REACHED


@pytest.mark.slow
def test_a_choice_says_whether_time_or_rig_ended_it(choose: Choose) -> None:
    short = choose(0.05, 0.6)
    assert short.ended is Ended.TIME
    assert short.schedule.seconds <= 3.0
    hopeless = choose(600.0, 0.02)
    assert hopeless.ended is Ended.NOTHING
    assert min(hopeless.checked.named_right()) < 0.9


@pytest.mark.parametrize("share", [0.5, 0.75])
def test_less_time_would_not_do(choose: Choose, share: float) -> None:
    found = choose(30.0, 0.6)
    assert choose(share * found.schedule.seconds / 60, 0.6).ended is not Ended.REACHED


def test_a_choice_that_leaves_an_effect_unnamed_is_shortened_too(setting: Setting) -> None:
    """No protocol names a modulus within the tolerances; the shortest loops name the friction."""
    found = _choose(setting, 30.0, 1.0, (("modulus_error",), ("hysteresis",)))
    assert found.ended is Ended.NOTHING
    assert found.checked.named_right()[1] >= 0.9
    assert found.schedule.seconds <= 2 * setting.rig.shortest_loop


def test_the_shortest_piece_alone_may_do(choose: Choose, setting: Setting) -> None:
    """Much information: one run names both effects, and no shorter protocol is looked for."""
    found = choose(30.0, 100.0)
    assert found.ended is Ended.REACHED
    assert found.schedule.seconds == min(piece.seconds for piece in setting.library)


def test_more_time_never_names_less(choose: Choose) -> None:
    named = [min(choose(minutes, 0.6).checked.named_right()) for minutes in (0.05, 0.2, 30.0)]
    assert named[0] < 0.9 <= named[-1]
    assert named[1] >= named[0]


def test_the_wanted_separations_name_with_the_wanted_probability() -> None:
    """Two simple hypotheses at the wanted separation: the log Bayes factor gives the right one the odds of a name in
    90 % of cases."""
    nothing, rival = wanted_separations(0.9)
    draws = np.random.default_rng(0).standard_normal(200_000)
    factor = np.maximum(rival / 2 + np.sqrt(rival) * draws, 0.0)
    odds = log_odds(np.zeros(1), np.ones(1)) - log_odds(factor, np.ones(1))
    assert float((odds > np.log(NAMED / (1 - NAMED))).mean()) == pytest.approx(0.9, abs=0.005)
    assert nothing > rival
