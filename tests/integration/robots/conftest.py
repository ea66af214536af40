"""Drives as MuJoCo plugins, exported and loaded once for all tests of this folder."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS as ALL_EFFECTS
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.table import Lookup
from tests.integration.robots.joint_models import LOSSY, MASSES, at_nominal


@pytest.fixture(autouse=True)
def _log_elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """MuJoCo writes its warnings to a file in the present folder."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def mujoco() -> Any:
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler on the PATH")
    return pytest.importorskip("mujoco", reason="foreign host mujoco")


@pytest.fixture(scope="session")
def exported(mujoco: Any, tmp_path_factory: pytest.TempPathFactory) -> Callable[[DriveModel, str], Path]:
    """Exports a model to a new folder of this name, and loads the plugin."""
    from reefmu.robots import export_mujoco, load_plugin

    def export(model: DriveModel, name: str) -> Path:
        folder = export_mujoco(model, tmp_path_factory.mktemp("plugins") / name, masses=MASSES)
        load_plugin(folder)
        return folder

    return export


@pytest.fixture(scope="session")
def plain_model(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, lookup=lookup)


@pytest.fixture(scope="session")
def lossy_model(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, LOSSY, lookup=lookup)


@pytest.fixture(scope="session")
def full_model(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    """Every effect at its nominal value, but times that a short test can see."""
    return at_nominal(build_model(drive, {e: {} for e in ALL_EFFECTS}, lookup=lookup))


@pytest.fixture(scope="session")
def plain(exported: Callable[[DriveModel, str], Path], plain_model: DriveModel) -> Path:
    return exported(plain_model, "plain")


@pytest.fixture(scope="session")
def lossy(exported: Callable[[DriveModel, str], Path], lossy_model: DriveModel) -> Path:
    return exported(lossy_model, "lossy")
