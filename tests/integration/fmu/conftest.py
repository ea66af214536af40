"""Two drives, with effects at every place of the model, and their FMUs, exported once for all tests of this folder."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS as ALL_EFFECTS
from reefmu.fmu.export import export_fmu
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.table import Lookup

EFFECTS = {
    "backlash": {"clearance": 2e-6},
    "structural_compliance": {"compliance": 5e-6},
    "hysteresis": {"torque": 4.0, "presliding": 5e-5},
    "kinematic_error": {"amplitude_1": 1e-5},
}


@pytest.fixture(scope="session")
def model(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, EFFECTS, lookup=lookup)


@pytest.fixture(scope="session")
def full_model(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    """Every effect at its nominal value."""
    return at_nominal(build_model(drive, {name: {} for name in ALL_EFFECTS}, lookup=lookup), band=0.3)


@pytest.fixture(scope="session")
def full_individual(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    """The same effects in an individual of the population."""
    return at_nominal(build_model(drive, {name: {} for name in ALL_EFFECTS}, lookup=lookup, individual=3))


def at_nominal(model: DriveModel, **values: float) -> DriveModel:
    sizes = {
        p.name: float(np.clip(p.nominal, p.minimum, p.maximum))
        for p in model.parameters
        if p.tunable and p.minimum is not None and p.maximum is not None
    }
    return model.with_parameters({**sizes, **values})


@pytest.fixture(scope="session")
def native(model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(model, tmp_path_factory.mktemp("native") / "drive_1.fmu", backend="native")


@pytest.fixture(scope="session")
def full_native(full_model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(full_model, tmp_path_factory.mktemp("native") / "full.fmu", backend="native")


@pytest.fixture(scope="session")
def full_native_individual(full_individual: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(full_individual, tmp_path_factory.mktemp("native") / "one.fmu", backend="native")


@pytest.fixture(scope="session")
def soft_model() -> DriveModel:
    """A drive ten times softer, without effects and states."""
    drive = sm.load_drive("drive_3")
    return build_model(drive, lookup=cached_lookup(drive, n_drives=8))


@pytest.fixture(scope="session")
def unpacked(full_model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, str]:
    """The native FMU of `full_model`, its folder and its GUID."""
    folder = tmp_path_factory.mktemp("unpacked")
    path = export_fmu(full_model, folder / "full.fmu", backend="native")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder / "out")
    return path, folder / "out", read_archive(path).guid


@pytest.fixture(scope="session")
def fmu(model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(model, tmp_path_factory.mktemp("fmu") / "drive_1.fmu", backend="python")


@pytest.fixture(scope="session")
def soft_fmu(soft_model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(soft_model, tmp_path_factory.mktemp("fmu") / "drive_3.fmu", backend="python")


@pytest.fixture(scope="session")
def description(fmu: Path) -> ElementTree.Element:
    with zipfile.ZipFile(fmu) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml"))


@pytest.fixture
def rewritten(fmu: Path, tmp_path: Path) -> Callable[[Callable[[str, bytes], bytes | None]], Path]:
    """Copy the FMU with `change` applied to each member; None leaves a member out."""

    def rewrite(change: Callable[[str, bytes], bytes | None]) -> Path:
        target = tmp_path / "rewritten.fmu"
        with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(target, "w") as copy:
            for name in source.namelist():
                content = change(name, source.read(name))
                if content is not None:
                    copy.writestr(name, content)
        return target

    return rewrite
