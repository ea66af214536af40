"""Seats of a row: elements that fit do not collide at any angle of the crank; and a preset that can be built."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.drawing.tolerances import iso_492_normal
from stiffness_model.geometry.seats import Seats
from stiffness_model.plotting.cross_section.layout import place_parts
from stiffness_model.plotting.cross_section.row_outlines import cage_radii

ISO_3290_DIAMETERS_MM = (5, 5.5, 6, 6.5, 7, 7.5, 8, 8.5, 9, 9.5, 10, 11, 12, 13, 14, 15, 16)
"""Preferred nominal ball diameters of ISO 3290-1 in this range."""


@given(st.integers(5, 40), st.integers(1, 40), st.floats(1e-3, 20e-3))
def test_chord_is_the_least_distance_between_bores(ratio, count, radius):
    seats = Seats(ratio, count, 48e-3, radius)
    if count > ratio:
        assert not seats.fits
        return
    angle = 2 * math.pi / ratio * (np.arange(count) * ratio // count)
    centre = 48e-3 * np.stack([np.cos(angle), np.sin(angle)], -1)
    distance = np.hypot(*(centre[:, None] - centre[None]).T) + np.diag(np.full(count, np.inf))
    assert seats.chord == pytest.approx(distance.min(), rel=1e-9)
    assert seats.fits == (distance.min() > 2 * radius)


@given(st.integers(5, 40), st.floats(1e-3, 20e-3), st.floats(0, 3e-3))
def test_greatest_number_of_elements_fits_and_more_do_not(ratio, radius, wall):
    most = Seats(ratio, 1, 48e-3, radius).max_elements(wall)
    assert Seats(ratio, most, 48e-3, radius).wall >= wall - 1e-9
    for more in range(most + 1, ratio + 2):
        assert Seats(ratio, more, 48e-3, radius).wall < wall


@pytest.mark.parametrize(("per_row", "fits"), [(14, True), (15, False), (21, False), (29, False)])
def test_balls_of_14_mm_need_every_second_seat(per_row, fits):
    """Up to 21 would fit side by side on a free circle, but from 15 on some occupy neighbouring seats."""
    drive = sm.load_drive("drive_1", elements=3 * per_row)
    assert drive.seats.fits == fits
    centre = place_parts(drive, 0.3).centre[0]
    nearest = min(np.linalg.norm(a - b) for k, a in enumerate(centre) for b in centre[:k])
    # The eccentric displaces the elements radially by 0.7 mm of 48 mm; the bores stay in place.
    assert nearest == pytest.approx(drive.seats.chord, rel=0.02)


def test_preset_workshop_can_be_built():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drive = sm.load_drive("workshop")
    rim = cage_radii(drive)[0]
    at_rim = 2 * (rim * math.sin(math.pi / drive.seats.seats) - drive.seats.bore_radius)
    assert drive.seats.spacing == 1
    assert drive.seats.wall > at_rim > 1.5e-3
    # The profile does not intersect itself, its crests are rounded, and all rows share one profile.
    assert drive.usable_limit == math.pi
    crest = 1 / drive.path.curvature(math.pi)
    assert crest + drive.element_radius < -0.25e-3
    assert np.abs(place_parts(drive).gear).max() < 1e-12
    # Balls and rings are standard parts.
    assert 2e3 * drive.element_radius in ISO_3290_DIAMETERS_MM
    ring = drive.tolerances["crank"]
    assert ring.window == pytest.approx(iso_492_normal(2 * drive.crank_radius))
    assert ring.offset == pytest.approx(-ring.window / 4)
    assert {material.name for material in drive.materials.values()} == {"100Cr6"}
    population = sm.simulate(drive, np.linspace(0, drive.max_twist, 17), 64)
    curve = population.curve()
    assert population.interference_count < 0.005 * 64 * drive.elements
    assert curve.lost_motion() < 1.5 * sm.ARCMIN
    assert 100 < curve.full_torque < 200
    pressure = sm.contact_pressures(drive, [drive.max_twist], 32).pressure.mean(axis=0)
    assert pressure.max() < 4.3e9


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
def test_paper_s_drives_state_that_they_cannot_be_built(name):
    with pytest.warns(sm.DoesNotFitWarning):
        drive = sm.load_drive(name)
    assert "cannot be built" in drive.description
