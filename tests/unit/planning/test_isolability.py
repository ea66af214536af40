"""Predicted probabilities: rows sum to 1, limits follow the noise, and a plan reaches what it promises."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from reefmu.diagnosis.calibrated_odds import CALIBRATED, NAMED, least_evidence
from reefmu.diagnosis.discrimination.effect_columns import AMPLITUDE_DEVIATION, Variant
from reefmu.diagnosis.discrimination.predicted_isolability import SIZES, isolability
from reefmu.diagnosis.discrimination.rival_hypotheses import RivalHypothesis
from reefmu.diagnosis.discrimination.simulated_scores import gaussian_scores
from reefmu.planning import Plan, Rig, make_plan, next_protocol
from reefmu.planning.design import design, make_targets, potential, wanted_separations
from reefmu.planning.next_experiment import NextProtocol
from reefmu.planning.protocols.motion_pieces import feasible
from reefmu.planning.setting import Setting
from stiffness_model import Drive
from stiffness_model.errors import InputError, UnknownNameError


def single(name: str, column: int) -> RivalHypothesis:
    return RivalHypothesis((name,), ((Variant(name, (column,), 1, False, False, 1.0),),), ((column,),))


PAIR = [single("creep", 0), single("structural_compliance", 1)]


@pytest.mark.slow
def test_rows_are_probabilities(plan: Plan) -> None:
    found = plan.isolability
    assert found.matrix.shape == (len(found.true) + 1, len(found.names) + 1)
    assert np.allclose(found.matrix.sum(axis=1), 1.0)
    assert (found.matrix >= 0).all()
    assert found.matrix[0, -1] > 0.97


@pytest.mark.parametrize("runs", [4, 16, 64])
def test_the_limit_falls_with_the_root_of_time(runs: int) -> None:
    """White noise without scatter: n equal runs have n times the information of one."""
    information = np.array([[40.0, 8.0], [8.0, 30.0]])
    one = isolability(gaussian_scores(information, 10, 0), PAIR, PAIR)
    many = isolability(gaussian_scores(runs * information, 10, 0), PAIR, PAIR)
    assert np.allclose(many.standard_error, one.standard_error / np.sqrt(runs))


def test_white_noise_runs_add_without_scatter(setting: Setting) -> None:
    """Copies of one run, with the random effects left out, multiply the information by their number."""
    from reefmu.planning.information import PieceInformation, total_information
    from reefmu.planning.protocols.schedule import make_schedule

    pieces = setting.candidates(setting.rig, [("creep",)], [("creep",)]).pieces
    inner = pieces.n_effects + pieces.n_base
    alone = PieceInformation(pieces.products[:, :inner, :inner], pieces.n_effects, pieces.n_base, pieces.library, ())
    once, thrice = (
        total_information(alone, make_schedule(setting.library, [5] * count, setting.rig)) for count in (1, 3)
    )
    assert np.allclose(thrice, 3 * once, rtol=1e-6, atol=1e-6 * np.abs(once).max())


def test_equal_columns_are_not_named() -> None:
    """Two effects with the same trace are detected, and neither is named."""
    found = isolability(gaussian_scores(400 * np.ones((2, 2)), 400, 0), PAIR, PAIR, SIZES)
    assert found.named_right("creep") == 0
    assert found.matrix[1, -1] == 1
    assert found.named_from("creep", 0.9) is None


def test_strong_separate_columns_are_named() -> None:
    found = isolability(gaussian_scores(np.diag([400.0, 400.0]), 400, 0), PAIR, PAIR, SIZES)
    assert found.named_right("creep") > 0.99
    limit = found.named_from("creep", 0.9)
    assert limit is not None
    # About sqrt(wanted separation) standard errors of 1/20.
    assert 0.5 < limit / (np.sqrt(wanted_separations(0.9)[0]) / 20) < 1.6


@pytest.mark.parametrize("separation", [8.0, 10.0, 12.0])
def test_an_effect_alone_is_named_where_the_diagnosis_would(separation: float) -> None:
    """One effect against nothing: its log evidence, s^2 / 2 (I + 1 / w^2) - ln(I w^2 + 1) / 2 for a score s of mean and
    variance I and a prior of width w, must reach what the calibrated odds of a name take."""
    information = separation**2
    found = isolability(gaussian_scores(np.array([[information]]), 20000, 0), PAIR[:1], PAIR[:1])
    least = least_evidence(np.log(NAMED / (1 - NAMED)) - CALIBRATED.first_effect)
    precision = 1 / AMPLITUDE_DEVIATION**2
    score = np.sqrt((information + precision) * (2 * least + np.log(information / precision + 1)))
    sides = norm.cdf((np.array([-score, score]) - information) / separation)
    assert found.named_right("creep") == pytest.approx(1 + sides[0] - sides[1], abs=0.01)


def test_a_design_reaches_what_all_pieces_reach(setting: Setting) -> None:
    sets = [("hysteresis",), ("damping",), ("creep",)]
    candidates = setting.candidates(setting.rig, sets, sets)
    allowed = feasible(setting.library)
    targets = make_targets(potential(candidates, allowed), 0.9)
    found = design(candidates, allowed, targets, 1800.0)
    assert found.share > 0.999
    assert found.schedule.seconds < 0.2 * setting.whole.seconds
    short = design(candidates, allowed, targets, 5.0)
    assert short.schedule.seconds <= 5.0
    assert short.share < found.share


@pytest.mark.slow
def test_what_cannot_be_told_is_said(plan: Plan) -> None:
    """Viscous friction needs an output that turns, and a locked crank cannot tell hysteresis from friction there."""
    assert plan.isolability.named_right("creep") > 0.9
    assert plan.isolability.named_right("hysteresis") < 0.1
    told = {(r.effect, r.rival): r.remedy for r in plan.remedies}
    assert "turns" in told["hysteresis", "coulomb_friction"]
    assert any(effect == "viscous_friction" and "turns" in remedy for (effect, _), remedy in told.items())
    assert plan.excluded["missing_ball"] == "the record has no crank angle"
    assert plan.seconds <= 6 * 60


def test_unknown_and_excluded_effects_are_refused(drive: Drive) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'hysteresis'"):
        make_plan(drive, Rig(), ["hysteresys"])
    with pytest.raises(InputError, match="the record has no crank angle"):
        make_plan(drive, Rig(crank="locked"), ["missing_ball"])


@pytest.fixture(scope="module")
def between_sets(drive: Drive) -> NextProtocol:
    return next_protocol(drive, Rig(), [("hysteresis",), ("coulomb_friction", "viscous_friction")])


@pytest.mark.slow
def test_the_next_protocol_names_the_right_set_in_nine_of_ten_records(between_sets: NextProtocol) -> None:
    assert between_sets.told_apart > 0.9


@pytest.mark.slow
def test_the_next_protocol_tells_sets_apart(drive: Drive, between_sets: NextProtocol) -> None:
    found = between_sets
    assert found.labels == ("hysteresis", "coulomb_friction + viscous_friction")
    assert found.told_apart > 0.8
    assert any(np.ptp(piece.crank) > 0 for piece in found.schedule.pieces)
    assert np.allclose(found.probability.sum(axis=1), 1.0)
    with pytest.raises(InputError, match="two sets"):
        next_protocol(drive, Rig(crank="locked"), [("hysteresis",), ("missing_ball",)])
