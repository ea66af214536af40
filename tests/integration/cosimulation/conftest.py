"""A joint with and without losses, and the FMUs of their drives."""

from __future__ import annotations

from pathlib import Path

import pytest

import stiffness_model as sm
from reefmu.fmu.codegen.compile import has_compiler
from reefmu.fmu.export import export_fmu
from reefmu.joint import JointModel
from reefmu.model.drive_model import build_model
from stiffness_model.lookup.build_lookup import Lookup
from tests.integration.cosimulation.joints import FREE, MASSES


@pytest.fixture(scope="session")
def joint(drive: sm.Drive, lookup: Lookup) -> JointModel:
    """An elastic drive in a damped joint."""
    return JointModel(build_model(drive, lookup=lookup), MASSES)


@pytest.fixture(scope="session")
def plain(joint: JointModel) -> JointModel:
    """The same joint without damping."""
    return JointModel(joint.drive, FREE)


@pytest.fixture(scope="session")
def lossy(drive: sm.Drive, lookup: Lookup) -> JointModel:
    effects = {"hysteresis": {"torque": 1.0, "presliding": 2e-4}, "structural_compliance": {"compliance": 2e-6}}
    return JointModel(build_model(drive, effects, lookup=lookup), MASSES)


@pytest.fixture(scope="session")
def plain_fmu(joint: JointModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(joint.drive, tmp_path_factory.mktemp("joint") / "plain.fmu", backend="python")


@pytest.fixture(scope="session")
def native_fmu(joint: JointModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not has_compiler():
        pytest.skip("no C compiler")
    return export_fmu(joint.drive, tmp_path_factory.mktemp("joint") / "native.fmu", backend="native")


@pytest.fixture(scope="session")
def lossy_fmu(lossy: JointModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(lossy.drive, tmp_path_factory.mktemp("joint") / "lossy.fmu", backend="python")
