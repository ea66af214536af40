"""Contacts of drawn elements: gaps, stiffness from the radii in contact, capped cases, and the usable elements."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import Contacts, build_contacts
from stiffness_model.contact.usable_elements import is_usable, usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.drawing.material_library import PLA, STEEL_100CR6
from stiffness_model.elasticity import hertz


@pytest.fixture(scope="module")
def drive() -> sm.Drive:
    return sm.load_drive("drive_3")


@pytest.fixture(scope="module")
def deviations(drive: sm.Drive) -> sampling.Deviations:
    return sampling.draw(drive, 0, 3, seed=4)


def eq_23(compliance: float, *curvatures: float) -> float:
    """K of eq. 23 from the four principal curvatures of the two bodies, in-plane ones first."""
    in_plane, normal_plane = curvatures[0] + curvatures[1], curvatures[2] + curvatures[3]
    total = in_plane + normal_plane
    cos_tau = abs(in_plane - normal_plane) / total
    return 1 / (3 / (4 * math.sqrt(2)) * compliance * math.sqrt(total * hertz.hertz_coefficient_exact(cos_tau) ** 3))


@pytest.mark.parametrize("k", [0, 40, 100, 250])
def test_stiffness_follows_eq_23(drive, deviations, k):
    contacts = build_contacts(drive, deviations)
    ball, crank, bore, q = (
        values.ravel()[k] for values in (deviations.element, deviations.crank, deviations.cage, deviations.gear)
    )
    steel, plastic = 2 * STEEL_100CR6.compliance, STEEL_100CR6.compliance + PLA.compliance
    # Normal to the plane crank and gear are straight, and so is the bore along its axis.
    assert contacts.stiffness_crank[k] == pytest.approx(eq_23(steel, 1 / ball, 1 / crank, 1 / ball, 0), rel=1e-8)
    assert contacts.stiffness_cage[k] == pytest.approx(eq_23(plastic, 1 / ball, -1 / bore, 1 / ball, 0), rel=1e-8)
    # The groove's radius is the path's plus the equidistant's distance; concave surfaces count negative.
    groove = -1 / (1 / float(drive.path.curvature(contacts.beta[k])) + q)
    if abs(contacts.beta[k]) < drive.usable_limit:
        assert contacts.stiffness_gear[k] == pytest.approx(eq_23(plastic, 1 / ball, groove, 1 / ball, 0), rel=1e-8)


def test_gaps_follow_from_the_radii(drive, deviations):
    contacts = build_contacts(drive, deviations)
    assert len(contacts) == 3 * 87
    np.testing.assert_allclose(contacts.gear_gap, (deviations.gear - deviations.element).ravel(), atol=1e-18)
    np.testing.assert_allclose(contacts.cage_gap, (deviations.cage - deviations.element).ravel(), atol=1e-18)
    np.testing.assert_allclose(contacts.radius_sum, (deviations.crank + deviations.element).ravel(), rtol=1e-15)
    loosened = build_contacts(drive, deviations, clearance=5e-6)
    np.testing.assert_allclose(loosened.gear_gap - contacts.gear_gap, 5e-6, rtol=1e-9)
    np.testing.assert_array_equal(loosened.cage_gap, contacts.cage_gap)


def test_rollers_have_line_contacts():
    drive = sm.load_drive("drive_3", element="roller", element_length="12 mm")
    contacts = build_contacts(drive, sampling.draw(drive, 0, 1, seed=4))
    assert contacts.exponent == 10 / 9
    steel, plastic = 2 * STEEL_100CR6.compliance, STEEL_100CR6.compliance + PLA.compliance
    np.testing.assert_allclose(contacts.stiffness_crank, hertz.line_stiffness(steel, 12e-3), rtol=1e-14)
    np.testing.assert_allclose(contacts.stiffness_gear, hertz.line_stiffness(plastic, 12e-3), rtol=1e-14)
    assert not contacts.capped.any()


def test_stiffness_is_capped_where_ball_and_bore_conform():
    drive = sm.load_drive("drive_1", cage_offset="0 um")
    contacts = build_contacts(drive, sampling.draw(drive, 0, 16, seed=4))
    # For a ball of 7 mm cos(tau) = 0.9999 at a gap of 0.35 um.
    close = contacts.cage_gap < 0.35e-6
    assert (contacts.capped == close).mean() > 0.995
    assert 0.6 < contacts.capped.mean() < 0.9
    np.testing.assert_allclose(
        contacts.stiffness_cage[contacts.capped], contacts.stiffness_cage[contacts.capped][0], rtol=1e-4
    )


def test_indexing_selects_elements_and_keeps_common_values(drive, deviations):
    contacts = build_contacts(drive, deviations)
    mask = is_usable(drive, contacts.beta)
    assert 0 < mask.sum() < len(contacts)
    assert np.all(np.abs(contacts[mask].beta) <= drive.usable_limit)
    assert contacts[mask].eccentricity == contacts.eccentricity
    assert contacts[np.array([5, 2])].radius_sum.tolist() == contacts.radius_sum[[5, 2]].tolist()


@pytest.mark.parametrize("chosen", [None, 3])
def test_usable_elements_are_those_of_all_contacts(drive, deviations, chosen):
    mask = is_usable(drive, deviations.beta) if chosen is None else np.arange(87) % chosen == np.arange(3)[:, None]
    elements = usable_elements(drive, deviations, 2e-6, None if chosen is None else mask)
    expected = build_contacts(drive, deviations, 2e-6)[mask.ravel()]
    for field in dataclasses.fields(Contacts):
        np.testing.assert_array_equal(getattr(elements.contacts, field.name), getattr(expected, field.name))
    np.testing.assert_array_equal(elements.deviations.gear, deviations.gear[mask])
    np.testing.assert_array_equal(elements.drive_index, np.repeat(np.arange(3), mask.sum(axis=1)))
    assert (elements.n_drives, elements.n_excluded) == (3, 3 * 87 - mask.sum())


def test_reduction_per_drive_gives_zero_to_a_drive_without_elements(drive, deviations):
    mask = np.zeros((3, 87), bool)
    mask[0, :2] = mask[2, 1:4] = True
    elements = usable_elements(drive, deviations, mask=mask)
    values = np.array([[1.0, 2.0, 4.0, 8.0, 16.0]])
    assert elements.reduce_per_drive(np.add, values).tolist() == [[3.0, 0.0, 28.0]]
    assert elements.reduce_per_drive(np.maximum, values).tolist() == [[2.0, 0.0, 16.0]]
    none = usable_elements(drive, deviations, mask=np.zeros((3, 87), bool))
    assert none.reduce_per_drive(np.add, np.zeros((1, 0))).tolist() == [[0.0, 0.0, 0.0]]
