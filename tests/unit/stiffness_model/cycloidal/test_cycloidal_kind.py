"""Cycloidal drives in the functions for drives of every kind: loading, simulation, lookup, and what they lack."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.cycloidal.cycloidal_lookup import mean_gear_torque
from stiffness_model.cycloidal.cycloidal_population import CycloidalPopulation
from stiffness_model.errors import InputError
from stiffness_model.io.drawing_toml import as_drive
from stiffness_model.kinds import CONTACT_FORCES, CONTACT_RESPONSES, INDIVIDUALS, SCALE_PICTURES, TOLERANCES, lacking
from stiffness_model.lookup.build_lookup import build_lookup


def test_the_preset_is_a_drive_like_others(tmp_path: Path) -> None:
    drive = sm.load_drive("printed_cycloidal", pins=12, profile_clearance="60 um")
    assert (drive.kind, drive.ratio) == ("cycloidal", -11)
    assert drive.profile_clearance == pytest.approx(60e-6)
    sm.save_drive(drive, tmp_path / "mine.toml")
    assert sm.load_drive(tmp_path / "mine.toml") == drive
    assert "printed_cycloidal" in sm.presets()
    found = sm.simulate(drive, [0.0, 0.01], n_drives=3)
    assert isinstance(found, CycloidalPopulation)
    assert found.torque.shape == (3, 2)


def test_it_has_what_its_kind_has() -> None:
    drive = sm.load_drive("printed_cycloidal")
    assert [bool(lacking(drive, what)) for what in (CONTACT_FORCES, TOLERANCES)] == [False, False]
    for what in (INDIVIDUALS, SCALE_PICTURES, CONTACT_RESPONSES):
        assert lacking(drive, what).startswith("printed_cycloidal is a cycloidal drive without ")
    with pytest.raises(InputError, match="expected a rolling element eccentric drive, got printed_cycloidal"):
        as_drive(drive)


@pytest.mark.slow
def test_lookup_is_that_of_the_population() -> None:
    """Tables of the mean torque and of its percentiles, with additional clearance as well."""
    drive = sm.load_drive("printed_cycloidal")
    lookup = build_lookup(drive)
    assert lookup.error["torque_mean"] < 2e-3
    twist = np.linspace(-1, 1, 9) * drive.max_twist
    for clearance in (0.0, 60e-6):
        many = sm.simulate(drive, twist, 2000, seed=5, clearance=clearance)
        bound = 0.05 * float(np.abs(many.torque.mean(0)).max())
        np.testing.assert_allclose(lookup.torque(twist, clearance), many.torque.mean(0), atol=bound)
        np.testing.assert_allclose(
            lookup.torque(twist, clearance), mean_gear_torque(drive, twist, clearance), atol=bound
        )
        low, high = np.percentile(many.torque, [10, 90], axis=0)
        np.testing.assert_allclose(lookup.torque(twist, clearance, band=-1), low, atol=3 * bound)
        np.testing.assert_allclose(lookup.torque(twist, clearance, band=1), high, atol=3 * bound)
