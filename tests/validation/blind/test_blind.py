"""The generator: its files do not reveal the truth, sizes and noise are as stated, and the scores count correctly."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.validation.blind.cases import WEIGHTS, case, cases
from tests.validation.blind.drawings import DRAWINGS
from tests.validation.blind.outside import KINDS
from tests.validation.blind.records import Case, make
from tests.validation.blind.scoring import figures, judge, wilson
from tests.validation.blind.sensors import Sensors
from tests.validation.blind.sizing import EFFECTS, rms

# -- files for the diagnosis ---------------------------------------------------------------------------------


@pytest.mark.slow
def test_files_have_the_canonical_columns_and_no_label(tmp_path):
    headers = set()
    for name in (None, "hysteresis", "wobble"):
        hidden = Case(0, "single", ((name, 5.0),) if name else (), protocol="one_loop")
        record, drawing = make(hidden).write(tmp_path / str(name))
        headers.add(record.read_text("utf-8").splitlines()[0])
        assert record.name == "record_0000.csv"
        assert drawing.read_text("utf-8") == DRAWINGS[0].toml
        text = record.read_text("utf-8") + drawing.read_text("utf-8")
        assert not any(label in text for label in (*EFFECTS, *KINDS))
    assert headers == {"time [s],run,crank_angle [rad],output_angle [rad],output_torque [N.m],temperature [degC]"}


@pytest.mark.slow
def test_missing_columns_are_left_out(tmp_path):
    record, _ = make(Case(3, "missing", protocol="locked", missing=("crank_angle", "run"))).write(tmp_path)
    assert record.read_text("utf-8").splitlines()[0] == "time [s],twist [arcmin],output_torque [N.m],temperature [degC]"


@pytest.mark.parametrize("name", [*EFFECTS, "wobble", "hardening"])
def test_an_effect_of_size_zero_gives_the_clean_record(name):
    clean = make(Case(4, "none", protocol="one_speed"))
    zero = make(Case(4, "single", ((name, 0.0),), protocol="one_speed"))
    for title, values in clean.table.items():
        np.testing.assert_array_equal(values, zero.table[title])


def test_the_same_case_gives_the_same_record_and_another_seed_another():
    what = replace(case(5), protocol="one_loop", drawing=0)
    first, again, other = make(what), make(what), make(replace(what, seed=1))
    torque = "output_torque [N.m]"
    np.testing.assert_array_equal(first.table[torque], again.table[torque])
    assert first.truth == again.truth
    assert not np.array_equal(first.table[torque], other.table[torque])
    json.loads(first.truth.to_json())


def test_the_catalogue_does_not_depend_on_the_count():
    assert cases(3, seed=2, first=40) == cases(60, seed=2)[40:43]
    categories = [c.category for c in cases(100, seed=3)]
    assert {name: categories.count(name) for name in WEIGHTS} == WEIGHTS


def test_a_late_torque_is_the_torque_of_a_moment_before():
    """No other channel is late."""
    what = Case(5, "none", protocol="one_loop", sensors=Sensors(0.0, jitter=0.0))
    plain, late = make(what), make(replace(what, sensors=Sensors(0.0, jitter=0.0, torque_delay=0.05)))
    torque, time = "output_torque [N.m]", "time [s]"
    for title, values in plain.table.items():
        assert np.array_equal(values, late.table[title]) == (title != torque)
    inside = plain.table[time] > plain.table[time][0] + 0.1
    before = np.interp(plain.table[time] - 0.05, plain.table[time], plain.table[torque])
    scale = np.abs(plain.table[torque]).max()
    np.testing.assert_allclose(late.table[torque][inside], before[inside], atol=1e-6 * scale)


# -- noise and sizes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.97])
def test_noise_has_the_stated_size_and_correlation(correlation):
    made = make(Case(6, "none", sensors=Sensors(0.004, correlation, of_angle=0.0)))
    noise, starts = made.reading.noise, made.test.starts
    assert made.truth.noise / made.truth.full_torque == pytest.approx(0.004, rel=0.1 if correlation > 0.9 else 0.04)
    inner = np.ones(len(noise), bool)
    inner[starts[:-1]] = False
    found = noise[inner] @ noise[np.flatnonzero(inner) - 1] / (noise @ noise)
    # Quantisation in steps of half the noise adds two per cent of white noise.
    assert found == pytest.approx(correlation, abs=0.05)


def test_noise_of_the_angle_acts_through_the_stiffness():
    made = make(Case(7, "none", sensors=Sensors(0.004, 0.0, of_angle=0.5)))
    assert made.truth.noise / made.truth.full_torque == pytest.approx(0.004, rel=0.04)
    steep = made.motion.stiffness > np.median(made.motion.stiffness)
    assert rms(made.reading.noise[steep]) > 1.2 * rms(made.reading.noise[~steep])


def test_time_does_not_decrease_and_runs_are_consecutive():
    made = make(Case(8, "none", sensors=Sensors(0.004, 0.5, jitter=0.05)))
    assert (np.diff(made.table["time [s]"]) >= 0).all()
    assert set(np.diff(made.table["run"])) <= {0, 1}
    assert 10_000 < len(made.table["run"]) < 14_000


@pytest.mark.parametrize("name", ["preload", "creep", "coulomb_friction", "missing_ball", "sensor_bend"])
def test_sizes_are_relative_to_the_noise(name):
    assert make(Case(9, "single", ((name, 4.0),))).truth.sigmas[name] == pytest.approx(4.0, rel=0.1)


# -- scores ----------------------------------------------------------------------------------------------


def test_outcomes_are_judged_by_verdict_names_and_alternatives():
    truth = make(Case(10, "single", (("backlash", 4.0),), protocol="one_speed")).truth
    size = truth.parameters["backlash"]["clearance"] * 1e6
    interval = {"clearance": {"value": size, "low": 0.9 * size, "high": 1.1 * size, "unit": "um"}}
    right = judge(
        truth,
        {
            "verdict": "named",
            "effects": [{"name": "backlash", "parameters": interval}],
            "gap": {"held_out_after": truth.noise},
        },
        1.0,
    )
    assert right.exact
    assert right.within
    assert right.covered == {"backlash.clearance": True}
    assert right.held_out == pytest.approx(1.0)
    wrong = judge(truth, {"verdict": "named", "effects": [{"name": "preload", "parameters": {}}]}, 1.0)
    assert wrong.wrong
    assert not wrong.within
    either = judge(truth, {"verdict": "ambiguous", "effects": [], "alternatives": [["wear"], ["backlash"]]}, 1.0)
    assert either.within
    assert not either.exact
    silent = judge(truth, {"verdict": "none", "effects": []}, 1.0)
    assert not any((silent.exact, silent.within, silent.wrong))
    assert "false alarm" in figures([right, wrong, either, silent])
    assert wilson(0, 0) == (0.0, 1.0)
