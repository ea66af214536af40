"""Cycles of a closed loop: the native FMU does not drift from the Python model; ten million steps: bench_drift.py."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from reefmu.fmu.model.component import drive_component
from reefmu.model.drive_model import DriveModel
from tests.benchmarks.simulation.bench_drift import closed
from tests.integration.fmu.replay import build_replay, repeat_model, replay

pytestmark = pytest.mark.skipif(
    shutil.which("gcc") is None or not sys.platform.startswith("linux"), reason="needs gcc on Linux"
)


def test_cycles_of_a_loop_cause_no_drift(
    full_model: DriveModel, unpacked: tuple[Path, Path, str], tmp_path: Path
) -> None:
    component = drive_component(full_model)
    excitation = closed(component, 400)
    rounds = 20
    came = replay(
        [str(build_replay(tmp_path / "host"))],
        next(unpacked[1].rglob("*.so")),
        unpacked[2],
        component,
        excitation,
        tmp_path,
        rounds=rounds,
    )
    expected = repeat_model(component, excitation, component.parameter_vector(), rounds)
    names = [s.name for s in (*component.outputs, *component.states)]
    assert came.shape == (rounds + 1, len(names))
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-12)
    scale[[names.index("output.tau"), names.index("measured.tau")]] = full_model.full_torque
    assert (np.abs(came - expected) / scale).max() < 1e-12
    # The loop has memory: the travel has grown, and the hysteresis ends every cycle in the same state.
    travel, deflection = came[:, names.index("wear.travel")], came[:, names.index("hysteresis.deflection")]
    assert travel[-1] == pytest.approx(rounds * travel[1], rel=1e-12)
    assert travel[1] > 10
    assert np.ptp(deflection[1:]) < 1e-3
    assert np.abs(came[5:, names.index("creep.twist")]).max() > 1e-7
