"""`import reefmu` gives what the README uses by one name each, and costs nothing until it is used."""

from __future__ import annotations

import subprocess
import sys

import pytest

import reefmu
from reefmu.model import DriveModel, build_model
from stiffness_model import Drive


@pytest.mark.parametrize("name", reefmu.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(reefmu, name).__name__ == name


def test_an_unknown_name_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="no attribute 'buildmodel'"):
        _ = reefmu.buildmodel


def test_the_import_alone_loads_nothing() -> None:
    code = "import sys, reefmu; print([m for m in ('numpy', 'casadi', 'control', 'fmpy', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_drives_and_models_show_themselves_in_a_line(drive: Drive, model: DriveModel) -> None:
    assert repr(drive) == "Drive('drive_1', 3 x 29 balls of 14 mm, 30 lobes, ratio -29)"
    assert repr(model).startswith("DriveModel('drive_1', no effects, ")
    inside = build_model(drive, {"creep": {}, "backlash": {}}, lookup=model.lookup)
    assert "backlash, creep" in repr(inside)
    assert "\n" not in repr(inside)
