"""Losses in native FMUs: the efficiency of the friction analysis in both directions, power balance, self-locking."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.fmu.codegen.compile import has_compiler
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.ratings.efficiency import expected_losses

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not has_compiler(), reason="no C compiler on the PATH")]

MASSES = Masses(1e-4, 1.0)
LOAD = 100.0
"""N.m at the output."""


@pytest.fixture(scope="module")
def rough() -> sm.Drive:
    return sm.load_drive("drive_1", friction_coefficient=0.05)


@pytest.fixture(scope="module")
def lossy(rough: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(rough, lookup=lookup)


def expected_efficiencies(model: DriveModel, rough: sm.Drive, torque: float) -> tuple[float, float]:
    """Of the friction analysis, with the crank driving and with the output driving, at a torque, N.m."""
    twists = np.linspace(0, rough.max_twist, 200)
    twist = float(np.interp(torque, model.lookup.torque(twists), twists))
    (driving,), (driven,) = expected_losses(rough, [twist]).mean_efficiencies()
    return float(driving), float(driven)


@pytest.fixture(scope="module")
def joint(lossy: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("losses") / "joint.fmu"
    return export_fmu(lossy, path, backend="native", masses=MASSES)


def powers_at_speed(path: Path, load: float, speed: float) -> tuple[float, float]:
    """Mean power of the motor and of the load, W, with the output at a speed, rad/s, held by a PI controller."""
    step, integral, rows = 5e-4, 0.0, []
    with FmuDrive(path) as fmu:
        ratio = fmu.set_values["ratio"]
        outputs = fmu.initialize({"load.tau": 0.0})
        for k in range(4000):
            wanted = speed * min(1.0, k / 400)
            error = ratio * wanted - outputs["crank.w"]
            integral += step * error
            inputs = {"motor.tau": 0.01 * error + 0.5 * integral, "load.tau": load * min(1.0, k / 400)}
            before = outputs
            outputs = fmu.step(step, inputs)
            mean = {name: (before[name] + outputs[name]) / 2 for name in ("crank.w", "output.w")}
            rows.append((inputs["motor.tau"] * mean["crank.w"], inputs["load.tau"] * mean["output.w"]))
    motor, outer = np.mean(rows[2000:], axis=0)
    return float(motor), float(outer)


def test_power_of_a_joint_is_balanced_in_both_directions(joint: Path, lossy: DriveModel, rough: sm.Drive) -> None:
    driving, driven = expected_efficiencies(lossy, rough, LOAD)
    for speed in (0.3, -2.0):
        motor, load = powers_at_speed(joint, -np.copysign(LOAD, speed), speed)
        assert motor > 0 > load
        assert -load / motor == pytest.approx(driving, abs=0.01)
        motor, load = powers_at_speed(joint, np.copysign(LOAD, speed), speed)
        assert motor < 0 < load
        assert -motor / load == pytest.approx(driven, abs=0.01)


def test_a_self_locking_joint_is_not_driven_back(
    lossy: DriveModel, rough: sm.Drive, lookup: Lookup, joint: Path, tmp_path: Path
) -> None:
    locking = build_model(rough, {"crank_friction": {"fraction": 1.4}}, lookup=lookup)
    path = export_fmu(locking, tmp_path / "locking.fmu", backend="native", masses=MASSES)
    moved = {}
    for name, file in (("locking", path), ("free", joint)):
        with FmuDrive(file) as fmu:
            fmu.initialize({})
            angles = [fmu.step(1e-3, {"load.tau": LOAD * min(1.0, k / 200)})["crank.phi"] for k in range(1500)]
        moved[name] = np.abs(angles)
    assert moved["free"][-1] > 100
    assert moved["locking"].max() < 2e-3 + 1.2 * LOAD / 29 / locking_stiffness(locking)
    assert np.ptp(moved["locking"][-300:]) < 1e-5, "it rests, but for the load on its spring"
    # The motor drives it all the same, against the friction.
    motor, load = powers_at_speed(path, -LOAD, 2.0)
    assert -load / motor == pytest.approx(1 / 2.4, abs=0.01)


def locking_stiffness(model: DriveModel) -> float:
    return next(p.value for p in model.parameters if p.name == "crank_friction.stiffness")


def test_check_passes_with_friction_that_sticks(rough: sm.Drive, lookup: Lookup, tmp_path: Path) -> None:
    effects = {
        "crank_friction": {"stribeck": 0.3, "viscous": 1e-4, "thinning": 0.03},
        "elastoplastic_friction": {"torque": 3.0, "stribeck": 0.2},
        "wear": {"rate": 1e-8},
        "creep": {"compliance": 1e-6},
    }
    model = build_model(rough, effects, lookup=lookup)
    report = check_fmu(export_fmu(model, tmp_path / "d.fmu", backend="native", fmi="3.0"))
    assert report.passed, str(report)
