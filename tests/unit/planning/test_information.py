"""Information along motion pieces: additive over runs, never falling, and none where a motion cannot show an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.discrimination.effect_columns import sensitivities
from reefmu.diagnosis.discrimination.rival_hypotheses import make_hypotheses, separations
from reefmu.diagnosis.discrimination.simulated_scores import information_under
from reefmu.planning.design import Candidates
from reefmu.planning.diagnosis_link import record_problem
from reefmu.planning.information import (
    piece_information,
    record_information,
    summed_products,
    total_information,
)
from reefmu.planning.protocols.motion_pieces import feasible
from reefmu.planning.protocols.rig import RigNoise, rig_noise
from reefmu.planning.protocols.schedule import make_schedule, measured_record
from reefmu.planning.setting import Setting
from stiffness_model.numerics.arrays import Array


@pytest.fixture(scope="module")
def candidates(setting: Setting) -> Candidates:
    names = [(name,) for name in setting.columns.candidates]
    return setting.candidates(setting.rig, names, names)


def of_effect(setting: Setting, information: Array, name: str) -> float:
    """Information about the amplitude of an effect's first variant."""
    k = next(v.columns[0] for v in setting.columns.variants if v.effect == name)
    return float(information[k, k])


def along(setting: Setting, candidates: Candidates, chosen: list[int]) -> Array:
    return total_information(candidates.pieces, make_schedule(setting.library, chosen, setting.rig))


def pieces_with(setting: Setting, word: str) -> list[int]:
    return [k for k, piece in enumerate(setting.library) if word in piece.label]


def test_runs_add_up_to_the_record(setting: Setting, candidates: Candidates) -> None:
    noise = rig_noise(setting.rig, setting.drive.ratio)
    whole = record_information(setting.columns, noise)
    sums = total_information(candidates.pieces, setting.whole)
    assert np.abs(sums - whole).max() < 1e-6 * np.abs(whole).max()


def test_a_piece_is_added_to_the_sum_of_the_others(setting: Setting, candidates: Candidates) -> None:
    """As a choice of motions adds them, copies among them: drift and wear follow the schedule of all."""
    loop, turns = pieces_with(setting, "loops to 100 %")[0], pieces_with(setting, "then loops")[1]
    schedule = make_schedule(setting.library, [loop, turns, loop], setting.rig)
    summed = summed_products(candidates.pieces, [turns, loop]) + summed_products(candidates.pieces, [loop])
    before = summed.copy()
    added = total_information(candidates.pieces, schedule, summed)
    whole = total_information(candidates.pieces, schedule)
    assert np.abs(added - whole).max() < 1e-9 * np.abs(whole).max()
    assert np.array_equal(summed, before)


def test_no_pieces_hold_no_information(setting: Setting, candidates: Candidates) -> None:
    """As where a rig can run none of them."""
    assert candidates.pieces.continued
    assert not along(setting, candidates, []).any()


def test_a_choice_of_pieces_is_as_informative_as_its_own_record(setting: Setting, candidates: Candidates) -> None:
    """Drift and wear go on over a record: along another schedule they are those of a record simulated along it."""
    loop, turns = pieces_with(setting, "loops to 100 %")[0], pieces_with(setting, "then loops")[1]
    schedule = make_schedule(setting.library, [loop, turns, loop], setting.rig)
    still = replace(setting.rig, output_noise=0.0, crank_noise=0.0)
    record = measured_record(setting.drive, still, schedule, 5)
    s = sensitivities(*record_problem(setting.drive, record), setting.sizes)
    own = record_information(s, rig_noise(setting.rig, setting.drive.ratio))
    chosen = total_information(candidates.pieces, schedule)
    # The blocks of the library's record are longer, so that its scatter is not quite the same: a tenth in deviation.
    for name in ("torque_sensor_drift", "wear", "backlash", "hysteresis"):
        assert of_effect(setting, chosen, name) == pytest.approx(of_effect(setting, own, name), rel=0.25), name


@pytest.fixture(scope="module")
def held_of_promised(setting: Setting) -> list[float]:
    """Separations of a clearance in two records of individuals, over that in the library: loops at five angles and
    rotation."""
    sets = [("backlash",)]
    candidates = setting.candidates(setting.rig, sets, sets)
    loops = [setting.library.index(p) for p in setting.library if p.label.startswith("loops to 100 %")][1:6]
    schedule = make_schedule(setting.library, [*loops, *pieces_with(setting, "under 0 %")], setting.rig)
    promised = float(candidates.found(schedule.chosen)[1][0][:, 0].min())
    found: list[float] = []
    for seed in (2, 3):
        record = measured_record(setting.drive, setting.rig, schedule, seed, individual=True)
        s = sensitivities(*record_problem(setting.drive, record), setting.sizes, ["backlash"])
        held = separations(
            record_information(s, rig_noise(setting.rig, setting.drive.ratio)), *[make_hypotheses(s, sets)] * 2
        )
        found.append(float(held[0][:, 0].min()) / promised)
    return found


def test_a_clearance_is_no_easier_to_see_in_the_library_than_in_a_record(held_of_promised: list[float]) -> None:
    """The tolerances of an individual act as a clearance, wherever the first guess of the twist's zero was."""
    assert min(held_of_promised) > 0.8


def test_a_clearance_is_no_harder_to_see_in_the_library_than_in_a_record(held_of_promised: list[float]) -> None:
    assert max(held_of_promised) < 1.2


def test_the_covariance_is_that_of_the_diagnosis(setting: Setting) -> None:
    """The information of a record of an individual is that of the diagnosis' own whitening, up to the noise that the
    diagnosis estimates in this record."""
    record = measured_record(setting.drive, setting.rig, setting.whole, 1, individual=True)
    s = sensitivities(*record_problem(setting.drive, record), setting.sizes)
    of_diagnosis = np.diag(information_under(s, s.problem.weights.with_size(1.0)))
    noise = s.problem.noise
    ours = np.diag(record_information(s, RigNoise(noise.torque, noise.twist, correlation=0.0)))
    big = of_diagnosis > 1.0
    assert big.sum() > 20
    # The diagnosis may count the noise as correlated; shares of scatter and noise are then the same to a third.
    ratio = ours[big] / of_diagnosis[big]
    assert np.median(np.abs(np.log(ratio / noise.correlation.correlation_time))) < 0.3
    assert np.log(ratio).std() < 0.2


def test_information_grows_with_every_piece(setting: Setting, candidates: Candidates) -> None:
    chosen = [k for k in feasible(setting.library) if setting.library[k].stage in ("cold", "holds")][:8]
    # Drift and wear depend on when a run begins; without them a further run can only add.
    held = [
        v.columns[0]
        for v in setting.columns.variants
        if v.effect not in ("torque_sensor_drift", "wear") and len(v.columns) == 1
    ]
    before = np.zeros((len(held), len(held)))
    for count in range(1, len(chosen) + 1):
        now = along(setting, candidates, chosen[:count])[np.ix_(held, held)]
        scale = max(float(np.abs(now).max()), 1.0)
        assert np.linalg.eigvalsh(now - before).min() > -1e-7 * scale
        before = now


def test_motions_without_the_cause_hold_no_information(setting: Setting, candidates: Candidates) -> None:
    cold = [k for k, piece in enumerate(setting.library) if piece.stage == "cold" and " 17 deg" in piece.label]
    information = along(setting, candidates, cold)
    # At 20 degC there is no thermal clearance, and a locked crank shows no order of its turn, only a shifted zero.
    assert of_effect(setting, information, "thermal_clearance") == pytest.approx(0.0, abs=1e-9)
    assert of_effect(setting, information, "kinematic_error") == pytest.approx(0.0, abs=1e-3)
    assert of_effect(setting, information, "viscous_friction") < 0.05
    assert of_effect(setting, information, "backlash") > 1
    warm = along(setting, candidates, [*cold, *pieces_with(setting, "at 60 degC")])
    assert of_effect(setting, warm, "thermal_clearance") > 100
    turning = along(setting, candidates, [*cold, *pieces_with(setting, "there and back")])
    assert of_effect(setting, turning, "kinematic_error") > 1
    assert of_effect(setting, turning, "viscous_friction") > 1


def test_a_later_loop_shows_drift(setting: Setting, candidates: Candidates) -> None:
    """The same loops apart in time show a drift; at once they hardly do."""
    loop = pieces_with(setting, "loops to 100 %")[0]
    hold = pieces_with(setting, "hold for 120 s")[0]
    near = of_effect(setting, along(setting, candidates, [loop, loop]), "torque_sensor_drift")
    far = of_effect(setting, along(setting, candidates, [loop, hold, loop]), "torque_sensor_drift")
    assert far > 3 * near


def test_effects_that_a_motion_makes_equal_are_not_separated(setting: Setting, candidates: Candidates) -> None:
    """With a locked crank, friction at the output and hysteresis are one; a turning crank separates them."""
    pair = make_hypotheses(setting.columns, [("hysteresis",), ("coulomb_friction",)])
    locked = [k for k, piece in enumerate(setting.library) if np.ptp(piece.crank) == 0 and " 17 deg" in piece.label]
    same = separations(along(setting, candidates, locked), pair, pair)
    assert same[0][:, 0].min() > 1000
    assert same[0][:, 2].max() < 1e-3 * same[0][:, 0].min()
    turning = separations(along(setting, candidates, [*locked, *pieces_with(setting, "there and back")]), pair, pair)
    assert turning[0][:, 2].min() > 100


def test_more_noise_leaves_less_information(setting: Setting) -> None:
    noise = rig_noise(setting.rig, setting.drive.ratio)
    quiet = piece_information(setting.columns, setting.whole, noise)
    noisy = piece_information(setting.columns, setting.whole, replace(noise, torque=3 * noise.torque))
    for name in ("hysteresis", "torque_sensor_offset", "creep"):
        assert of_effect(setting, total_information(noisy, setting.whole), name) < of_effect(
            setting, total_information(quiet, setting.whole), name
        )
