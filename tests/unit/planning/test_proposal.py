"""The experiment that a diagnosis proposes: which explanations are open, and a protocol that tells them apart."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.diagnosis import Diagnosis, Gap, Hypothesis, NamedEffect, diagnose_record
from reefmu.diagnosis.analysis import Analysis, ProposedExperiment
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource
from reefmu.planning import propose_protocol
from reefmu.planning.proposal import DECISIVE, open_explanations
from reefmu.record import read_record
from tests import diagnosis_rig as rig

COLUMNS = {
    "time [s]": "time [s]",
    "run": "run",
    "twist [arcmin]": "twist [arcmin]",
    "torque_set_point [N.m]": "output_torque [N.m]",
}


def verdict(name: str, *effects: str, alternatives: tuple[tuple[str, ...], ...] = ()) -> Diagnosis:
    named = tuple(NamedEffect(effect, {}, 0.5) for effect in effects)
    gap = Gap(1.0, 1.0, 1.0)
    return Diagnosis(name, "", named, alternatives, (), gap, (), shown_alternatives=alternatives)


def test_open_explanations_are_the_likely_ones_and_those_of_an_ambiguous_verdict() -> None:
    hypotheses = [
        Hypothesis(("wear", "creep"), False, 0.5),
        Hypothesis((), True, 0.2),
        Hypothesis((), False, 0.15),
        Hypothesis(("damping",), False, 0.04),
        Hypothesis(("damping",), True, 0.03),
        Hypothesis(("preload",), False, 0.04),
    ]
    named = verdict("named", "creep", "wear").with_probabilities(hypotheses, None, None)
    assert open_explanations(named) == (("creep", "wear"), ("damping",))
    more = [
        *hypotheses[1:],
        Hypothesis(("wear", "creep"), False, 0.4),
        Hypothesis(("wear", "creep", "damping"), False, 0.1),
    ]
    assert open_explanations(named.with_probabilities(more, None, None)) == (("creep", "wear"), ("damping",))
    shown = replace(named, shown_alternatives=(("creep", "damping", "wear"),)).with_probabilities(more, None, None)
    assert open_explanations(shown) == (("creep", "wear"), ("creep", "damping", "wear"), ("damping",))
    ambiguous = verdict("ambiguous", "preload", alternatives=(("wear",), ("modulus_error",)))
    found = open_explanations(ambiguous.with_probabilities(hypotheses, None, None))
    assert found == (("preload",), ("wear",), ("modulus_error",), ("creep", "wear"))


@pytest.fixture(scope="module")
def one_loop() -> Analysis:
    """Friction in one loop at a locked crank, which may be inside the gear or at the output."""
    record = rig.measured({"coulomb_friction": {"torque": 5.0}}, full=False)
    found = analyse(record, BaseCurveSource(rig.drive()))
    assert isinstance(found, Analysis)
    return found


def test_a_rig_that_cannot_decide_is_told_so(one_loop: Analysis) -> None:
    """No rate of this rig tells where the friction is."""
    assert one_loop.diagnosis.verdict == "ambiguous"
    inside_or_outside = _proposed(one_loop, ("coulomb_friction",), ("hysteresis",))
    assert inside_or_outside.sentence.endswith("apart: at typical sizes none is ever named")
    _check_nothing_is_proposed(one_loop, inside_or_outside)


@pytest.mark.slow
def test_a_rig_that_decides_too_rarely_is_told_so(one_loop: Analysis) -> None:
    """Another rate tells damping, one of three explanations: a protocol would name the right one too rarely."""
    beside_damping = _proposed(one_loop, ("coulomb_friction",), ("hysteresis",), ("damping",))
    shown = re.search(r"the best one would name the right one in at most (\d+) %", beside_damping.sentence)
    assert shown is not None
    assert 30 <= int(shown[1]) < 100 * DECISIVE
    _check_nothing_is_proposed(one_loop, beside_damping)


def _check_nothing_is_proposed(found: Analysis, proposed: ProposedExperiment) -> None:
    assert proposed.sentence.startswith("no protocol on the rig of this record tells")
    assert proposed.protocol == ""
    assert found.with_proposal(proposed).diagnosis.next_experiment[0] == proposed.sentence


@pytest.mark.slow
def test_a_rig_that_can_decide_gets_a_protocol(one_loop: Analysis) -> None:
    """Where friction and damping are left, which another rate tells apart."""
    proposed = _proposed(one_loop, ("coulomb_friction",), ("damping",))
    shown = re.search(r"it names the right one in at most (\d+) %", proposed.sentence)
    assert shown is not None
    assert int(shown[1]) >= 100 * DECISIVE
    assert proposed.protocol != ""


def _proposed(found: Analysis, *sets: tuple[str, ...]) -> ProposedExperiment:
    """What is proposed where these sets of effects are open explanations, equally likely."""
    open_ones = [Hypothesis(names, False, 1 / len(sets)) for names in sets]
    diagnosis = replace(found.diagnosis, effects=(), alternatives=(), shown_alternatives=())
    proposed = propose_protocol(replace(found, diagnosis=diagnosis.with_probabilities(open_ones, None, None)))
    assert proposed is not None
    return proposed


def test_a_decided_record_and_a_gear_without_drawing_get_no_proposal(one_loop: Analysis) -> None:
    sure = one_loop.diagnosis.with_probabilities([Hypothesis(("hysteresis",), False, 1.0)], None, None)
    assert (
        propose_protocol(
            replace(one_loop, diagnosis=replace(sure, verdict="named", alternatives=(), shown_alternatives=()))
        )
        is None
    )
    undrawn = analyse(one_loop.record, BaseCurveSource())
    assert isinstance(undrawn, Analysis)
    assert propose_protocol(undrawn) is None


@pytest.mark.slow
def test_the_protocol_is_a_file_beside_the_report(one_loop: Analysis, tmp_path: Path) -> None:
    """It stays within the rig of the record, and a later diagnosis without a proposal removes it."""
    record = one_loop.record
    found = diagnose_record(record, rig.drive(), out=tmp_path, propose=_for_two_that_a_loop_tells_apart)
    assert re.match(
        r"next_protocol.csv tells .* apart on this rig: \d+ runs?, [\d.]+ (s|min); "
        r"at typical sizes it names the right one in at most \d+ % of cases$",
        found.next_experiment[0],
    )
    assert json.loads((tmp_path / "diagnosis.json").read_text())["next_experiment"] == list(found.next_experiment)
    assert "next_protocol.csv tells" in (tmp_path / "report.html").read_text()
    protocol = read_record(tmp_path / "next_protocol.csv", COLUMNS)
    assert 0 < np.abs(protocol.output_torque).max() <= 1.01 * np.abs(record.output_torque).max()
    assert np.ptp(protocol.crank_angle) == 0, "the crank of this record stands"
    diagnose_record(record, rig.drive(), out=tmp_path)
    assert not (tmp_path / "next_protocol.csv").exists()


def _for_two_that_a_loop_tells_apart(found: Analysis) -> ProposedExperiment | None:
    hypotheses = [Hypothesis(("hysteresis",), False, 0.5), Hypothesis(("backlash",), False, 0.5)]
    diagnosis = replace(found.diagnosis, verdict="unknown", effects=(), alternatives=(), shown_alternatives=())
    return propose_protocol(replace(found, diagnosis=diagnosis.with_probabilities(hypotheses, None, None)))
