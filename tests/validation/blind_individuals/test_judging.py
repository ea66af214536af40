"""The scoring rules, each by an answer that is right and one that is not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.validation.blind_individuals.__main__ import score
from tests.validation.blind_individuals.figures import calibration, calibration_by_chance
from tests.validation.blind_individuals.judging import judge


def _row(names: tuple[str, ...] = (), answer: dict[str, Any] | None = None, **changes: Any) -> dict[str, Any]:
    truth = {
        "seed": 0,
        "number": 1,
        "category": "single",
        "names": list(names),
        "foreign": False,
        "foreign_seen": 0.0,
        "protocol": "full",
        "individual": True,
        "separable": True,
        "base_off": False,
        "detectable": dict.fromkeys(names, 9.0),
        "isolable": dict.fromkeys(names, 9.0),
        "over_scatter": dict.fromkeys(names, 9.0),
        "rivals": dict.fromkeys(names, ()),
        "parameters": {name: {"clearance": 1e-5} for name in names},
        "deviations": {"backlash": 1e-6, "preload": 1e-6},
    }
    return {
        "truth": truth | changes,
        "answer": answer or {"verdict": "none"},
        "seconds": 1.0,
        "processor": 1.0,
        "error": "",
    }


def _said(verdict: str, *names: str, value: float = 10.0, **more: Any) -> dict[str, Any]:
    size = {"clearance": {"value": value, "low": 0.9 * value, "high": 1.1 * value, "unit": "um"}}
    return {"verdict": verdict, "effects": [{"name": name, "parameters": size} for name in names], **more}


def test_the_right_name_is_exact_and_its_interval_is_looked_at():
    found = judge(_row(("backlash",), _said("named", "backlash")))
    assert found.exact
    assert found.within
    assert found.covered == {"backlash.clearance": True}
    assert judge(_row(("backlash",), _said("named", "backlash", value=20.0))).covered == {"backlash.clearance": False}


def test_the_sign_that_does_not_fit_is_a_wrong_name():
    found = judge(_row(("backlash",), _said("named", "preload")))
    assert found.wrong
    assert not found.within


def test_the_truth_among_the_alternatives_is_within_but_not_exact():
    found = judge(_row(("backlash",), _said("ambiguous", "wear", alternatives=[["backlash"]])))
    assert found.within
    assert not found.exact
    assert not found.wrong


def test_twins_are_one_set_only_where_the_record_cannot_tell_them_apart():
    answer = _said("named", "wear", twins=[["backlash", "wear", "a test"]])
    assert judge(_row(("backlash",), answer, rivals={"backlash": ["wear"]})).within
    assert not judge(_row(("backlash",), answer)).within


def test_nothing_is_right_as_none_and_an_alarm_otherwise():
    assert judge(_row(category="scatter")).exact
    alarm = judge(_row((), _said("unknown"), category="scatter"))
    assert alarm.alarm
    assert not judge(_row((), {"verdict": "insufficient"}, category="scatter")).alarm


@pytest.mark.parametrize("base", [True, False])
def test_modulus_or_tolerance_is_right_for_either(base):
    names = () if base else ("modulus_error",)
    sets = _said("ambiguous", "modulus_error", alternatives=[[]])
    words = _said("named", "modulus_error", sentence="The modulus or tolerance of the base curve explains it.")
    for answer in (sets, words):
        found = judge(_row(names, answer, base_off=base, category="base" if base else "single"))
        assert found.exact
        assert not found.wrong
        assert found.alarm is not base
    other = _said("ambiguous", "modulus_error", alternatives=[["structural_compliance"]])
    assert not judge(_row(names, other, base_off=base)).exact


def test_something_unnamed_is_detected_as_unknown_partly_or_among_the_sets():
    for answer in (_said("unknown"), _said("partly"), _said("ambiguous", "wear", alternatives=[None])):
        assert judge(_row((), answer, foreign=True)).detected
    assert not judge(_row((), _said("named", "wear"), foreign=True)).detected
    assert judge(_row((), _said("named", "wear"), foreign=True)).wrong
    assert judge(_row(("backlash",), _said("partly", "backlash"), foreign=True)).exact


def test_an_effect_far_below_its_tolerance_is_not_to_be_named():
    tiny = _row(("backlash",), _said("named", "backlash", value=0.05), parameters={"backlash": {"clearance": 5e-8}})
    assert judge(tiny).negligible == ("backlash",)
    assert judge(_row(("backlash",), _said("named", "backlash"))).negligible == ()
    assert judge(_row((), _said("named", "preload", value=0.05))).negligible == ("preload",)
    assert judge(_row((), _said("ambiguous", "preload", value=0.05))).negligible == ()


def test_hypotheses_that_cannot_be_told_apart_are_one():
    answer = _said("named", "backlash") | {
        "hypotheses": [
            {"effects": ["backlash"], "probability": 0.6},
            {"effects": ["wear"], "probability": 0.3},
            {"effects": None, "probability": 0.1},
        ]
    }
    assert judge(_row(("backlash",), answer)).hypotheses == ((0.6, True), (0.3, False), (0.1, False))
    merged = judge(_row(("backlash",), answer, rivals={"backlash": ["wear"]})).hypotheses
    assert merged[0] == (pytest.approx(0.9), True)
    assert judge(_row((), answer, foreign=True)).hypotheses[0] == (0.1, True)


def test_calibration_is_the_mean_distance_from_the_diagonal():
    perfect = [(0.75, True)] * 3 + [(0.75, False)]
    assert calibration(perfect)[0] == 0
    assert calibration([(1.0, False)] * 5)[0] == 1


def test_few_answers_look_miscalibrated_by_chance():
    """Of n answers in one bin the frequency deviates by sqrt(2/pi) standard deviations in the mean."""
    for n in (25, 400):
        mean, most = calibration_by_chance([0.75] * n)
        deviation = np.sqrt(0.75 * 0.25 / n)
        assert mean == pytest.approx(np.sqrt(2 / np.pi) * deviation, rel=0.15)
        assert most == pytest.approx(1.96 * deviation, rel=0.15)


def test_tables_with_and_without_probabilities():
    plain = [_row(("backlash",), _said("named", "backlash")), _row(category="clean")]
    assert "no probabilities in these answers" in score(plain)
    sure = _said("named", "backlash") | {
        "hypotheses": [{"effects": ["backlash"], "probability": 0.96}],
        "global_p": 0.3,
    }
    assert "likeliest hypothesis: expected calibration error 0.040" in score([_row(("backlash",), sure)])
    failed = _row(("backlash",)) | {"answer": None, "error": "ValueError: no"}
    assert "ValueError" in score([failed])
