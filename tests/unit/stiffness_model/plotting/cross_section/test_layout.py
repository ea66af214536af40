"""Kinematics: elements touch eccentric and profile at every crank angle, and the motion is periodic."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.drawing import sampling
from stiffness_model.errors import InputError
from stiffness_model.plotting.cross_section.layout import Layout, period_turns, place_parts
from stiffness_model.plotting.cross_section.outline import gear_outline, rotated
from tests.unit.stiffness_model.plotting.cross_section.polygons import distances


def check_contacts(drive: sm.Drive, layout: Layout) -> None:
    """Every element touches its eccentric and its row's profile, by the profile's equation."""
    reach = np.hypot(*np.moveaxis(layout.centre - layout.eccentric[:, None], -1, 0))
    np.testing.assert_allclose(reach, drive.path.centre_distance, rtol=1e-13)
    in_gear = layout.bore - layout.gear[:, None]
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(layout.centre, -1, 0)), drive.path.radius(drive.lobes * in_gear), rtol=1e-12
    )


@settings(max_examples=60, deadline=None)
@given(
    ratio=st.integers(5, 60),
    together=st.booleans(),
    rows=st.integers(1, 4),
    taken=st.floats(0.3, 1),
    angle=st.floats(-50, 50),
)
def test_elements_touch_eccentric_and_profile(
    ratio: int, together: bool, rows: int, taken: float, angle: float
) -> None:
    count = max(1, int(taken * ratio))
    drive = sm.load_drive(
        "drive_1",
        transmission_ratio=ratio,
        lobes=ratio - 1 if together else ratio + 1,
        eccentrics=rows,
        elements=rows * count,
    )
    layout = place_parts(drive, angle)
    check_contacts(drive, layout)
    assert layout.beta.shape == (rows, count)
    np.testing.assert_allclose(np.exp(1j * layout.beta), np.exp(1j * (layout.crank[:, None] - layout.bore)), atol=1e-9)
    # The eccentrics are evenly spread, so the crank is balanced.
    assert np.abs(np.exp(1j * layout.crank).sum()) < 1e-9 or rows == 1
    # With the gear fixed the profile stays and the cage turns by 1/ratio.
    start = place_parts(drive)
    np.testing.assert_allclose(layout.gear, start.gear, atol=1e-12)
    np.testing.assert_allclose(layout.bore - start.bore, angle / drive.ratio, atol=1e-12)
    np.testing.assert_allclose(layout.crank - start.crank, angle, atol=1e-12)


def test_the_layout_repeats_after_its_period(drawn: sm.Drive) -> None:
    """The set of elements repeats, and not before."""

    def picture(angle: float) -> np.ndarray:
        centres = place_parts(drawn, angle).centre.reshape(-1, 2)
        return centres[np.lexsort(np.round(centres.T, 9))]

    turns = period_turns(drawn)
    np.testing.assert_allclose(picture(2 * np.pi * turns), picture(0.0), atol=1e-12)
    for earlier in range(1, turns):
        assert np.abs(picture(2 * np.pi * earlier) - picture(0.0)).max() > 1e-5


def test_balls_touch_the_trimmed_profile_through_a_turn(drawn: sm.Drive) -> None:
    """There is no gap where the profile exists and no overlap anywhere, within the polygon's chord error."""
    outline = gear_outline(drawn, chord_error=1e-6)
    for angle in np.linspace(0, 2 * np.pi, 7):
        layout = place_parts(drawn, angle)
        for row, turn in enumerate(layout.gear):
            gap = distances(layout.centre[row], rotated(outline.points, turn)) - drawn.element_radius
            exists = np.abs(layout.beta[row]) <= drawn.usable_limit
            assert exists.any()
            assert np.abs(gap[exists]).max() <= 1.01e-6
            assert gap.min() >= -1.01e-6


def test_balls_where_the_profile_is_cut_away_have_a_gap(drive: sm.Drive) -> None:
    """0.16 mm between two lobes, where the profile beyond the crest does not exist."""
    outline, layout = gear_outline(drive), place_parts(drive)
    gap = distances(layout.centre[0], outline.points) - drive.element_radius
    assert gap.max() == pytest.approx(0.163e-3, rel=0.02)
    assert np.abs(layout.beta[0, gap.argmax()]) > 3


def test_rows_have_the_positions_of_the_simulated_drives(drive: sm.Drive) -> None:
    """Eq. 20, with elements k, k + n_ecc, ... on one eccentric."""
    for lobes in (28, 30):
        drive = sm.load_drive("drive_1", lobes=lobes)
        beta = sampling.draw(drive, 0, 1, 4).beta
        angle = beta[0, 0] * drive.transmission_ratio / lobes
        np.testing.assert_allclose(
            np.exp(1j * place_parts(drive, angle).beta.T.ravel()), np.exp(1j * beta[0]), atol=1e-12
        )


def test_one_profile_serves_all_rows_where_lobes_and_eccentrics_share_no_factor() -> None:
    for lobes, rows, straight in ((30, 3, False), (28, 3, True), (30, 2, False), (29, 2, True), (31, 3, True)):
        ratio = lobes - 1
        drive = sm.load_drive("drive_1", transmission_ratio=ratio, lobes=lobes, eccentrics=rows, elements=rows * ratio)
        layout = place_parts(drive)
        assert (layout.gear == 0).all() == straight == (math.gcd(lobes, rows) == 1)
        # In either case eq. 20 holds: all rows together divide the profile evenly.
        gaps = np.diff(np.sort(layout.beta.ravel()))
        np.testing.assert_allclose(gaps, 2 * np.pi / (rows * ratio), rtol=1e-9)


def test_bars_between_bores(roomy: sm.Drive, drive: sm.Drive) -> None:
    centre, ball = 48e-3, 4e-3
    expected = 2 * centre * math.sin(math.pi / 29) - 2 * ball - 2 * roomy.tolerances["cage"].offset
    assert roomy.seats.wall == pytest.approx(expected)
    assert drive.seats.wall < 0


def test_more_elements_than_seats_are_refused() -> None:
    drive = sm.load_drive("drive_1", elements=90)
    with pytest.raises(InputError, match="at most 29 elements on one eccentric"):
        place_parts(drive)
    with pytest.raises(InputError, match="angle"):
        place_parts(sm.load_drive("drive_1"), math.nan)
