"""What a diagnosis says of friction at the crank, which one torque alone does not show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.diagnosis.fitted_values import NamedEffect
from reefmu.diagnosis.pipeline import _with_friction_at_the_crank
from reefmu.diagnosis.report.corrected_model import corrected_model
from reefmu.diagnosis.schema import Diagnosis, Gap
from reefmu.effects.effect_facts import select_candidates
from reefmu.model.chosen_effects import inherent_effects, undiagnosed_effects
from reefmu.model.drive_model import describe_effects
from reefmu.model.model_file import load_model, save_model
from reefmu.record import make_record
from stiffness_model.catalog.efficiency_table import EfficiencyTable
from tests.friction_record import GEAR, fitted_friction


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


def test_a_corrected_model_keeps_the_efficiency_of_its_data_sheet(tmp_path: Path) -> None:
    lossy = replace(GEAR, efficiency=EfficiencyTable((100.0,), (50.0, 200.0), ((0.6, 0.8),)))
    stated = inherent_effects(lossy)["crank_friction"]
    twist = 2e-3 * np.sin(np.linspace(0, 4 * np.pi, 400))
    problem, fit = fitted_friction(twist, None, ("hysteresis",), gear=lossy)
    save_model(corrected_model(problem, fit), tmp_path / "model.toml")
    effects = describe_effects(load_model(tmp_path / "model.toml"))
    assert set(effects) == {"hysteresis", "crank_friction"}
    assert {name: effects["crank_friction"][name] for name in stated} == stated
