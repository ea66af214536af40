"""A conclusion is a function of the evidence, which it leaves as it was."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.inference.verdict import decide, select_effects, withdraw_effects
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource
from tests import diagnosis_rig as rig


@pytest.fixture(scope="module")
def found() -> Analysis:
    found = analyse(rig.measured({"coulomb_friction": {"torque": 5.0}}, full=False), BaseCurveSource(rig.drive()))
    assert isinstance(found, Analysis)
    return found


def test_the_same_evidence_gives_the_same_conclusion(found: Analysis) -> None:
    evidence = found.evidence
    before = {field.name: getattr(evidence, field.name) for field in fields(evidence)}
    for conclusion in (decide(select_effects(evidence)), decide(select_effects(evidence))):
        assert conclusion.verdict == found.conclusion.verdict
        assert conclusion.alternatives == found.conclusion.alternatives
        assert conclusion.remainder == found.conclusion.remainder
        np.testing.assert_array_equal(conclusion.chosen.parameters, found.conclusion.chosen.parameters)
    assert all(getattr(evidence, name) is value for name, value in before.items())


def test_the_hypothesis_of_the_mean_drive_is_another_value(found: Analysis) -> None:
    evidence = found.evidence
    was_mean_drive, base = evidence.problem.is_mean_drive, evidence.search.base
    other = evidence.for_mean_drive(evidence.search.best[1][0])
    assert other.problem.is_mean_drive
    assert other.search.base is evidence.search.best[1][0]
    assert evidence.problem.is_mean_drive == was_mean_drive
    assert evidence.search.base is base


def test_withdrawn_effects_leave_a_remainder_without_a_name(found: Analysis) -> None:
    withdrawn = withdraw_effects(found.evidence.problem, found.evidence.search.base, found.conclusion)
    assert (withdrawn.verdict, withdrawn.chosen.names, withdrawn.alternatives) == ("unknown", (), ())
    assert withdrawn.remainder > found.conclusion.remainder
