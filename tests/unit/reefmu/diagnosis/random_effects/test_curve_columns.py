"""Deviations of a whole curve."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.random_effects.curve_columns import COMMON_SHARE, SCALE, common_deviations, curve_columns
from stiffness_model.numerics.arrays import Array

TORQUE = np.linspace(-200.0, 200.0, 401)
RIPPLE = np.where(np.arange(401) % 2, 5.0, -5.0)


def _covariance(*deviations: Array) -> Array:
    """Of individuals with so many independent deviations."""
    return sum((np.outer(one, one) for one in deviations), np.zeros((len(deviations[0]), len(deviations[0]))))


def test_the_curve_may_be_off_as_the_curves_of_individuals_are() -> None:
    """Individuals that differ by 3 % in scale, and by ripple that makes no curve, give a scale of 3 % and no more."""
    found = curve_columns(TORQUE, _covariance(0.03 * TORQUE, RIPPLE))
    assert np.abs(found.T @ found - np.outer(0.03 * TORQUE, 0.03 * TORQUE)).max() < 0.1


def test_bends_are_as_wide_as_those_of_individuals() -> None:
    bend = 0.02 * TORQUE * (np.abs(TORQUE) / 100.0 - 1.0)
    found = curve_columns(TORQUE, _covariance(0.03 * TORQUE, bend))
    assert found.T @ found == pytest.approx(_covariance(0.03 * TORQUE, bend), abs=1e-9)


def test_both_flanks_deviate_alike() -> None:
    columns = curve_columns(TORQUE, _covariance(0.03 * TORQUE, np.abs(TORQUE), RIPPLE))
    assert columns == pytest.approx(-columns[:, ::-1], abs=1e-9)


def test_without_torque_there_is_no_deviation() -> None:
    assert not curve_columns(np.zeros(5), np.ones((5, 5))).any()


def test_all_elements_share_a_scale_and_a_tenth_of_what_makes_curves_of_individuals_differ() -> None:
    """Ripple, however large, belongs to single elements."""
    ripple, bend = 10 * RIPPLE, 0.02 * TORQUE * (np.abs(TORQUE) / 100.0 - 1.0)
    found = common_deviations(TORQUE, _covariance(ripple, bend))
    expected = _covariance(SCALE * TORQUE, COMMON_SHARE * bend)
    assert found.T @ found == pytest.approx(expected, abs=0.01 * expected.max())


def test_a_drive_whose_parts_do_not_deviate_still_has_the_modulus_of_its_steel() -> None:
    found = common_deviations(TORQUE, np.zeros((401, 401)))
    assert found.T @ found == pytest.approx(_covariance(SCALE * TORQUE))
