"""A user's priors: read with their units, refused in one line where they are wrong, and counted in the odds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from reefmu.cli.program import main
from reefmu.diagnosis import Diagnosis, Priors, diagnose_record, load_priors
from reefmu.diagnosis.probabilities.assessment import record_sizes
from reefmu.diagnosis.probabilities.calibration import probabilities
from reefmu.diagnosis.probabilities.priors import NO_PRIORS, UNNAMED, priors_from_dict
from stiffness_model.errors import InputError, UnknownNameError
from tests import diagnosis_rig as rig
from tests.unit.reefmu.diagnosis.probabilities.conftest import Fitted, make_row

TEXT = """
[odds]
wear = 5
unnamed = 0.1
[sizes]
backlash.clearance = "4 um"
hysteresis.torque = "0.0025 kN.m"
modulus_error.error = 0.2
"""


def test_values_are_read_with_their_units(tmp_path: Path) -> None:
    file = tmp_path / "priors.toml"
    file.write_text(TEXT, "utf-8")
    found = load_priors(file)
    assert found.odds == {"wear": 5.0, UNNAMED: 0.1}
    assert found.sizes == pytest.approx(
        {"backlash.clearance": 4e-6, "hysteresis.torque": 2.5, "modulus_error.error": 0.2}
    )


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"ods": {}}, "did you mean 'odds'"),
        ({"odds": {"waer": 2}}, "did you mean 'wear'"),
        ({"odds": {"wear": 0}}, "odds between 1e-06 and 1e\\+06"),
        ({"odds": {"wear": True}}, "odds between"),
        ({"odds": 3}, r"a table \[odds\]"),
        ({"sizes": {"backlash": {"clearence": "4 um"}}}, "did you mean 'clearance'"),
        ({"sizes": {"backlash": {"clearance": 4}}}, "a length with its unit|a text with its unit"),
        ({"sizes": {"backlash": {"clearance": "four um"}}}, "a length with its unit"),
        ({"sizes": {"backlash": {"clearance": "-4 um"}}}, "a size above zero, such as '5 um'"),
        ({"sizes": {"backlash": {"clearance": "4 N"}}}, "unknown unit of length 'N'"),
        ({"sizes": {"backlash": "4 um"}}, "a table of parameters"),
        ({"sizes": {"hysteresis": {"presliding": "1 mrad"}}}, "unknown parameter 'presliding'"),
    ],
)
def test_slips_are_refused_in_one_line(table: dict[str, object], message: str) -> None:
    with pytest.raises((InputError, UnknownNameError), match=message) as caught:
        priors_from_dict(table, "mine.toml")
    assert str(caught.value).startswith("mine.toml")
    assert "\n" not in str(caught.value)


def test_odds_multiply_those_of_the_record() -> None:
    sets = [(), ("wear",), ("creep", "wear")]
    rows = [make_row(frozenset(names), unnamed, 0.0) for names in sets for unnamed in (False, True)]
    before, after = (
        np.array([h.probability for h in probabilities(rows, priors)])
        for priors in (NO_PRIORS, Priors({"wear": 5.0, UNNAMED: 0.1}))
    )
    np.testing.assert_allclose(after / before / (after / before)[0], [1, 0.1, 5, 0.5, 5, 0.5])
    assert after.sum() == pytest.approx(1.0)


def test_sizes_are_those_of_the_user(fitted: Fitted) -> None:
    usual = record_sizes(fitted.problem)
    changed = record_sizes(fitted.problem, Priors(sizes={"hysteresis.torque": 7.0}))
    assert changed == usual | {"hysteresis.torque": 7.0}


def test_the_command_reads_them_before_it_diagnoses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    priors, record = tmp_path / "priors.toml", tmp_path / "record.csv"
    priors.write_text("[odds]\nwaer = 2\n", "utf-8")
    record.write_text("time [s],twist [arcmin],output_torque [N.m]\n0,0,0\n1,1,1\n2,0,0\n", "utf-8")
    out = tmp_path / "out"
    assert main(["diagnose", str(record), "--power-law", "--priors", str(priors), "--out", str(out)]) == 2
    assert "did you mean 'wear'" in capsys.readouterr().err
    assert not out.exists()


def test_comparisons_take_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["diagnose", "a.csv", "b.csv", "--compare", "--priors", "priors.toml", "--out", str(tmp_path / "out")]
    assert main(words) == 2
    assert "no --priors with --compare" in capsys.readouterr().err


@pytest.mark.slow
def test_odds_decide_what_a_record_leaves_open(tmp_path: Path) -> None:
    """One loop at a locked crank: friction inside and at the output are equally probable but for what is known."""
    file = tmp_path / "priors.toml"
    file.write_text("[odds]\ncoulomb_friction = 9\n", "utf-8")
    record = rig.measured({"coulomb_friction": {"torque": 5.0}}, full=False)
    plain, known = diagnose_record(record, rig.drive()), diagnose_record(record, rig.drive(), priors=file)

    def odds(found: Diagnosis) -> float:
        chance = {h.effects: h.probability for h in found.hypotheses if not h.unnamed}
        return chance["coulomb_friction",] / chance["hysteresis",]

    assert odds(plain) == pytest.approx(1.0, rel=1e-3)
    assert odds(known) == pytest.approx(9.0, rel=1e-3)
    assert (plain.verdict, known.verdict) == ("ambiguous", "named")
    assert known.notes == (
        *plain.notes,
        "probabilities hold for the priors that were given: odds of coulomb_friction 9",
    )
