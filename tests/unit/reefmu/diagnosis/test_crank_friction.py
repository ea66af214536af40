"""What a diagnosis says of friction at the crank, which one torque alone does not show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.diagnosis.estimation.problem import select_candidates
from reefmu.diagnosis.fitted_values import NamedEffect
from reefmu.diagnosis.pipeline import _with_friction_at_the_crank
from reefmu.diagnosis.schema import Diagnosis, Gap
from reefmu.model.chosen_effects import inherent_effects, undiagnosed_effects
from reefmu.record import make_record


@pytest.mark.parametrize("base", ["drawing", "power law"])
def test_it_is_no_candidate_and_the_reason_says_what_would_show_it(base: str) -> None:
    candidates, excluded = select_candidates((), base)
    for name in ("crank_friction", "elastoplastic_friction"):
        assert name not in candidates
    assert "torques of crank and output" in excluded["crank_friction"]
    assert "both directions" in excluded["crank_friction"]
    assert "coulomb_friction" in excluded["elastoplastic_friction"]


def test_a_record_of_the_motor_s_torque_cannot_tell_it_from_friction_inside() -> None:
    record = make_record({"time": np.arange(3.0), "twist": np.arange(3.0) * 1e-3, "output_torque": np.arange(3.0)})
    gap = Gap(5.0, 0.4, 0.4)
    effects = tuple(NamedEffect(name, {}, 0.5) for name in ("hysteresis", "creep"))
    found = Diagnosis("named", "", effects, (), (), gap, ())
    assert _with_friction_at_the_crank(found, record) == found
    ((first, second, test),) = _with_friction_at_the_crank(
        found, replace(record, torque_side="motor")
    ).indistinguishable
    assert (first, second) == ("hysteresis", "crank_friction")
    assert "torques of crank and output" in test


def test_a_corrected_model_keeps_the_drawing_s_losses() -> None:
    rough = sm.load_drive("drive_1", friction_coefficient=0.05)
    assert set(undiagnosed_effects(rough)) == set(inherent_effects(rough)) == {"crank_friction"}
    assert undiagnosed_effects(sm.load_drive("CHA-40A-50")) == {}
