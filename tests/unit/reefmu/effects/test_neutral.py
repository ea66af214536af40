"""Neutral parameters change nothing, to the bit, one effect or all."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.effects import EFFECTS, Place
from reefmu.model.drive_model import DriveModel
from reefmu.simulate import simulate_signal

from .conftest import Build, Trajectory


@pytest.mark.parametrize("names", [[name] for name in EFFECTS] + [list(EFFECTS)], ids=lambda n: "+".join(n)[:30])
def test_neutral_effects_change_nothing(
    names: list[str], build: Build, model: DriveModel, trajectory: Trajectory
) -> None:
    neutral = build({name: {} for name in names})
    found = simulate_signal(neutral, trajectory.time, trajectory.inputs).outputs
    assert np.array_equal(found, simulate_signal(model, trajectory.time, trajectory.inputs).outputs)


@pytest.mark.parametrize("name", EFFECTS)
def test_only_the_amplitudes_must_be_neutral(
    name: str, build: Build, model: DriveModel, trajectory: Trajectory
) -> None:
    amplitudes = EFFECTS[name].amplitudes
    values = {p.name: p.neutral if p.name in amplitudes else p.nominal for p in EFFECTS[name].parameters}
    found = simulate_signal(build({name: values}), trajectory.time, trajectory.inputs).outputs
    assert np.array_equal(found, simulate_signal(model, trajectory.time, trajectory.inputs).outputs)


@pytest.mark.parametrize("name", EFFECTS)
def test_a_nominal_size_changes_the_torque(
    name: str, build: Build, model: DriveModel, trajectory: Trajectory, typical
) -> None:
    output = "crank.tau" if EFFECTS[name].place is Place.CRANK else "measured.tau"
    found = simulate_signal(build({name: typical[name]}), trajectory.time, trajectory.inputs)[output]
    plain = simulate_signal(model, trajectory.time, trajectory.inputs)[output]
    assert np.isfinite(found).all()
    assert np.abs(found - plain).max() > 1e-3
