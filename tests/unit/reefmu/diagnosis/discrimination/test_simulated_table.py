"""What a diagnosis would name along simulated records: among sets of two, and under the likeliest scatter."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.calibrated_odds import CALIBRATED, NAMED, least_evidence
from reefmu.diagnosis.discrimination.effect_columns import Variant
from reefmu.diagnosis.discrimination.rival_hypotheses import RivalHypothesis
from reefmu.diagnosis.discrimination.simulated_scores import ScoresAtSize, SimulatedScores, gaussian_scores
from reefmu.diagnosis.discrimination.simulated_table import SimulatedTable
from reefmu.diagnosis.estimation.score_test import eliminate
from stiffness_model.numerics.arrays import Array

NAMES = ("creep", "damping", "hysteresis")
CANDIDATES = [
    RivalHypothesis((name,), ((Variant(name, (k,), 1, False, False, 1.0),),), ((k,),)) for k, name in enumerate(NAMES)
]
NONE = len(NAMES)
COUNT = 400


def names(simulated: SimulatedScores, trace: list[float]) -> Array:
    """Shares of the names that a trace gets, the last of none."""
    found = SimulatedTable(simulated, CANDIDATES).names(np.tile(np.array(trace), (COUNT, 1)), np.arange(COUNT))
    return np.bincount(found, minlength=NONE + 1) / COUNT


def test_two_effects_are_not_named_as_one() -> None:
    simulated = gaussian_scores(np.diag([400.0, 400.0, 400.0]), COUNT, 0)
    assert names(simulated, [1.0, 0.0, 0.0])[0] > 0.98
    assert names(simulated, [1.0, 1.0, 0.0])[NONE] > 0.98


def test_sets_of_two_take_a_part_of_the_probability_of_one() -> None:
    """Beside an effect with odds of about 2 against nothing, another one of three deviations makes the verdict open."""
    information = np.diag([45.0, 45.0, 1e-9])
    alone, both = (
        names(gaussian_scores(information, COUNT, 1), [1.0, share, 0.0])[0] for share in (0.0, 3 / np.sqrt(45.0))
    )
    assert alone - both > 0.1


def at_two_sizes(cost_of_the_wider: float) -> SimulatedScores:
    """Records with a scatter that absorbs the first effect wholly if it is wider, which costs something."""
    narrow = gaussian_scores(np.diag([400.0, 400.0, 400.0]), COUNT, 0).at[0]
    absorbing = np.diag([1e-6, 1.0, 1.0])
    wide = ScoresAtSize(narrow.information @ absorbing, narrow.scores @ absorbing, narrow.cost + cost_of_the_wider, 1.0)
    return SimulatedScores(narrow.information, (narrow, wide))


def test_nothing_is_as_likely_as_under_its_likeliest_scatter() -> None:
    """An effect that a wider scatter absorbs is named where that costs more than a name takes."""
    least = 2 * least_evidence(np.log(NAMED / (1 - NAMED)) - CALIBRATED.first_effect)
    assert names(at_two_sizes(50 * least), [1.0, 0.0, 0.0])[0] > 0.98
    assert names(at_two_sizes(0.5 * least), [1.0, 0.0, 0.0])[0] < 0.02
    assert names(at_two_sizes(0.5 * least), [0.0, 1.0, 0.0])[1] > 0.98


@pytest.mark.parametrize("unit", [1.0, 1e6])
def test_what_free_parameters_absorb_is_eliminated_in_any_unit(unit: float) -> None:
    rng = np.random.default_rng(0)
    effects, base, random = rng.standard_normal((50, 3)), rng.standard_normal((50, 2)), rng.standard_normal((50, 4))
    effects[:, 2] = base[:, 1]
    rows = np.concatenate([effects, base * [1.0, unit], random], axis=1)
    found = eliminate(rows.T @ rows, 3, 2)
    covariance = np.eye(50) + random @ random.T
    inverse = np.linalg.inv(covariance)
    rest = inverse - inverse @ base @ np.linalg.solve(base.T @ inverse @ base, base.T @ inverse)
    np.testing.assert_allclose(found, effects.T @ rest @ effects, atol=1e-8)
