"""Records of individual drives along motions of a library: what the diagnosis finds in them where nothing is missing,
and what a prediction for them counts."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.discrimination.effect_columns import ACCUMULATING, linear_in_time, sensitivities
from reefmu.diagnosis.discrimination.simulated_scores import information_under, scores_of_records
from reefmu.diagnosis.inference.nonparametric import fit_terms
from reefmu.diagnosis.preparation import with_individuals
from reefmu.planning.diagnosis_link import problems_of_records, record_problem
from reefmu.planning.protocols.schedule import Schedule, make_schedule, measured_record
from reefmu.planning.setting import Setting, check_schedule

ROTATIONS = ("at 5 rad/s under 50", "at 50 rad/s under 50", "at 50 rad/s under -50")
OTHERS = ("20 % of the greatest twist at crank 257", "0.6 s a loop", "at 0.5 rad/s under 90", "at 40 degC")


@pytest.fixture(scope="module")
def schedule(setting: Setting) -> Schedule:
    """Loops, and rotation at several speeds, each under one load."""
    labels = [piece.label for piece in setting.library]
    twice, once = ([k for k, label in enumerate(labels) if any(p in label for p in of)] for of in (ROTATIONS, OTHERS))
    assert (len(twice), len(once)) == (3, 4)
    return make_schedule(setting.library, [*twice, *twice, *once], setting.rig)


@pytest.mark.parametrize("seed", [1, 3])
def test_the_noise_of_the_twist_is_nothing_unnamed(setting: Setting, schedule: Schedule, seed: int) -> None:
    """Where the load is constant a function of speed and torque that is steep over the torque would explain the noise
    of the twist, if both had it: with the twist as measured it gains 107 and 50, as much as something unnamed."""
    record = measured_record(setting.drive, setting.rig, schedule, seed, individual=True)
    problem, fit = record_problem(setting.drive, record)
    terms = [term for term in fit_terms(problem, fit) if term.term.coordinate.startswith("speed of the output")]
    assert terms
    assert terms[0].gain < 5


def test_records_of_one_motion_share_the_scatter_and_not_the_noise(setting: Setting, schedule: Schedule) -> None:
    """What was shared changes -2 log likelihood by less than a record's noise in the angles does."""
    records = [measured_record(setting.drive, setting.rig, schedule, seed, individual=True) for seed in (1, 2)]
    (first, _), (second, fit) = problems_of_records(setting.drive, records)
    alone, own = record_problem(setting.drive, records[1])
    assert second.scatter is first.scatter
    assert second.noise.torque == alone.noise.torque != first.noise.torque
    np.testing.assert_array_equal(second.variance, alone.variance)
    assert fit.weighting.size == own.weighting.size
    assert fit.cost == pytest.approx(own.cost, rel=0.01)


def test_simulated_scores_have_the_covariance_that_is_assumed(setting: Setting, schedule: Schedule) -> None:
    """Along a record of the mean drive they are noise: their covariance is the information, their mean zero."""
    record = measured_record(setting.drive, setting.rig, schedule, 1)
    problem, fit = record_problem(setting.drive, record)
    columns = sensitivities(problem, fit, setting.sizes, ["hysteresis", "damping", "creep", "torque_sensor_offset"])
    weights = problem.weights.for_mean_drive()
    simulated = scores_of_records(columns, weights, 400, seed=0)
    information = information_under(columns, weights)
    np.testing.assert_allclose(simulated.information, information, rtol=1e-6, atol=1e-6 * np.diag(information).max())
    amplitudes = [v.columns[0] for v in columns.variants]
    at = simulated.at[0]
    scores, own = at.scores[:, amplitudes], information[np.ix_(amplitudes, amplitudes)]
    deviation = np.sqrt(np.diag(own))
    assert np.abs(scores.mean(axis=0) / deviation).max() < 0.3
    assert scores.std(axis=0) / deviation == pytest.approx(np.ones(len(amplitudes)), abs=0.15)


def test_a_diagnosis_finds_individuals_under_their_own_scatter(setting: Setting, schedule: Schedule) -> None:
    """The likeliest size of the scatter of simulated individuals is that of the drives, and far smaller ones are not
    looked at."""
    record = measured_record(setting.drive, setting.rig, schedule, 2, individual=True)
    problem, fit = record_problem(setting.drive, record)
    columns = sensitivities(with_individuals(problem, 16), fit, setting.sizes, ["hysteresis"])
    simulated = scores_of_records(columns, fit.weighting, 40, seed=0)
    cost = np.array([at.cost for at in simulated.at])
    likeliest = np.array([at.size for at in simulated.at])[cost.argmin(axis=0)]
    assert np.median(likeliest) == pytest.approx(fit.weighting.size, rel=0.5)
    assert len(simulated.at) < 10


def test_a_library_has_no_drift_that_settles(setting: Setting) -> None:
    """Its column along other records with the same runs does not follow from that along the library."""
    record = measured_record(setting.drive, setting.rig, setting.whole, 1)
    complete = sensitivities(*record_problem(setting.drive, record), setting.sizes, list(ACCUMULATING))
    count = [
        len([v for v in s.variants if v.effect == "torque_sensor_drift"]) for s in (complete, linear_in_time(complete))
    ]
    assert count[0] > count[1] == 1


@pytest.mark.slow
def test_records_checked_by_several_processes_name_as_often(setting: Setting, schedule: Schedule) -> None:
    sets = [("hysteresis",), ("backlash",)]
    few = replace(setting, names=["hysteresis", "backlash", "torque_sensor_offset"])
    here = check_schedule(few, schedule, sets, sets)
    with ProcessPoolExecutor(2) as pool:
        there = check_schedule(few, schedule, sets, sets, spread=pool.map)
    np.testing.assert_array_equal(there.isolability.matrix, here.isolability.matrix)
    for one, other in zip(there.separations, here.separations, strict=True):
        np.testing.assert_array_equal(one, other)
