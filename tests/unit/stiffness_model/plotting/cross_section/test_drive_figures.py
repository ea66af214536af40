"""Contents of the figures: parts in their geometric positions, arrows that add up to the torque."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Polygon
from matplotlib.quiver import Quiver

import stiffness_model as sm
from stiffness_model.contact.element_contacts import CONTACTS
from stiffness_model.drawing import sampling
from stiffness_model.errors import InputError
from stiffness_model.plotting.cross_section.drive_figures import drawing_figure, forces_figure
from stiffness_model.plotting.cross_section.element_forces import ElementForces, solve_element_forces
from stiffness_model.plotting.cross_section.row_outlines import row_outlines
from tests.picture_layout import layout_faults
from tests.unit.stiffness_model.plotting.cross_section.polygons import crossings, distances

QUICK = ((28, 0, 0.3), (30, 7, 1.0), (28, 7, -0.6), (30, 0, -0.6))
"""Lobes, seeds and shares of max_twist of the plain run: each value once at least; the slow tier has all of them."""


def arrows(figure: Figure, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Tips, m, and forces, N, of all arrows of one contact in a figure, (n, 2) each."""
    drawn = [q for ax in figure.axes for q in ax.collections if isinstance(q, Quiver) and q.get_gid() == name]
    tips = np.concatenate([np.asarray(q.get_offsets()) for q in drawn]) / 1e3
    return tips, np.concatenate([np.stack([q.U, q.V], -1) for q in drawn])


def moment(point: np.ndarray, force: np.ndarray) -> float:
    """Moment about the drive's axis, N.m."""
    return float((point[:, 0] * force[:, 1] - point[:, 1] * force[:, 0]).sum())


def loaded(drive: sm.Drive, share: float = 0.8) -> ElementForces:
    return solve_element_forces(drive, sampling.draw(drive, 0, 1, 3), share * drive.max_twist, 0.4)


@pytest.mark.parametrize(
    ("lobes", "seed", "share"),
    [
        pytest.param(*case, marks=() if case in QUICK else pytest.mark.slow)
        for case in itertools.product([28, 30], [0, 7], [0.3, 1.0, -0.6])
    ],
)
def test_drawn_arrows_have_the_drive_s_torque_as_their_moment(lobes: int, seed: int, share: float) -> None:
    """The cage's arrows, reversed, have the population's torque as their moment; gear and crank balance them."""
    drive = sm.load_drive("drive_1", lobes=lobes)
    deviations = sampling.draw(drive, 0, 1, seed)
    twist = share * drive.max_twist
    angle = float(deviations.beta[0, 0]) * drive.transmission_ratio / lobes
    figure = forces_figure(drive, solve_element_forces(drive, deviations, twist, angle))
    expected = sm.simulate(drive, [twist], 1, seed)
    by_kind = {name: arrows(figure, name) for name in CONTACTS}
    on_output = -sum(moment(*by_kind[name]) for name in ("cage t+", "cage t-"))
    # Arrows below a millionth of the greatest force are omitted.
    assert on_output == pytest.approx(expected.torque[0, 0], rel=1e-5)
    assert moment(*by_kind["gear"]) + moment(*by_kind["crank"]) == pytest.approx(on_output, rel=1e-4)
    for k, name in enumerate(CONTACTS):
        lengths = np.hypot(*by_kind[name][1].T)
        assert lengths.max(initial=0.0) == pytest.approx(expected.contact_force[0, 0, k], rel=1e-9, abs=1e-6)
    assert f"{expected.torque[0, 0]:.4g} N.m" in figure.legends[0].get_title().get_text()


def test_forces_on_every_element_balance(drawn: sm.Drive) -> None:
    forces = loaded(drawn)
    assert forces.magnitude.max() > 10
    np.testing.assert_allclose(forces.force.sum(axis=2), 0, atol=1e-6 * forces.magnitude.max())
    assert (forces.magnitude[~forces.usable] == 0).all()


def test_arrows_end_at_the_points_of_contact(drawn: sm.Drive) -> None:
    """Tips are on the circles of elements and crank, within displacements of some um."""
    forces = loaded(drawn)
    middle = forces.layout.centre[:, :, None]
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(forces.point - middle, -1, 0))[forces.usable], drawn.element_radius, atol=1e-4
    )
    from_crank = forces.point[:, :, 1] - forces.layout.eccentric[:, None]
    np.testing.assert_allclose(np.hypot(*np.moveaxis(from_crank, -1, 0))[forces.usable], drawn.crank_radius, atol=1e-4)


def test_arrow_lengths_and_colours_show_the_force(roomy: sm.Drive) -> None:
    """All arrows, including the reference arrow, have one scale; the most heavily loaded element is the darkest."""
    figure, forces = forces_figure(roomy, loaded(roomy)), loaded(roomy)
    drawn = [q for ax in figure.axes for q in ax.collections if isinstance(q, Quiver)]
    assert len({q.scale for q in drawn}) == 1
    scale = next(q for q in drawn if q.get_gid() == "scale")
    assert f"{scale.U[0]:g} N" in [text.get_text() for ax in figure.axes for text in ax.texts]
    elements = [p for ax in figure.axes for p in ax.patches if p.get_gid() == "element"]
    size = forces.magnitude.max(axis=-1).ravel()
    assert len(elements) == size.size == 87
    filled = np.array([p.get_facecolor()[3] > 0 for p in elements])
    np.testing.assert_array_equal(filled, size > 1e-6 * size.max())
    brightness = np.array([sum(p.get_facecolor()[:3]) for p in elements])
    order = np.argsort(size[filled])
    assert (np.diff(brightness[filled][order]) <= 1e-9).all()


def test_parts_are_drawn_to_scale(roomy: sm.Drive) -> None:
    """Balls of nominal size touch the drawn profile and crank, and overlap neither the cage nor each other."""
    forces = solve_element_forces(roomy, sampling.nominal(roomy), 0.0, 0.3)
    figure = drawing_figure(roomy, forces)
    ax = figure.axes[0]
    balls = [p for p in ax.patches if isinstance(p, Circle)]
    (gear,) = [p for p in ax.patches if isinstance(p, PathPatch) and p.get_gid() == "gear"]
    bars = [np.asarray(p.get_xy())[:-1] for p in ax.patches if isinstance(p, Polygon) and p.get_gid() == "cage"]
    (crank,) = [np.asarray(p.get_xy())[:-1] for p in ax.patches if isinstance(p, Polygon) and p.get_gid() == "crank"]
    assert len(balls) == len(bars) == 29
    assert {ball.radius for ball in balls} == {4.0}
    centres = np.array([ball.center for ball in balls])
    profile = np.asarray(gear.get_path().vertices)
    profile = profile[-np.flatnonzero(gear.get_path().codes[::-1] == 1)[0] - 1 : -1]
    gap = distances(centres, profile) - 4.0
    assert np.abs(gap[forces.usable[0]]).max() < 2e-3  # mm
    assert gap.min() > -2e-3
    np.testing.assert_allclose(distances(centres, crank), 4.0, atol=2e-3)
    for bar in bars:
        assert distances(centres, bar).min() > 4.0 - 1e-9
    apart = np.hypot(*(centres[:, None] - centres).T)
    assert apart[~np.eye(29, dtype=bool)].min() > 8.0
    # One maximum of the radius per lobe.
    radius = np.hypot(*profile.T)
    assert ((radius > np.roll(radius, 1)) & (radius >= np.roll(radius, -1))).sum() == roomy.lobes
    text = "\n".join(text.get_text() for text in figure.axes[2].texts)
    for size in (
        "ratio -29",
        "30 lobes",
        "eccentricity 0.7 mm",
        "pitch radius 48 mm",
        "ball diameter 8 mm",
        "crank radius 44 mm",
    ):
        assert size in text
    assert "cage bars of 2.38 mm" in figure.axes[1].get_title(loc="left")


def test_overlapping_elements_are_reported(drive: sm.Drive) -> None:
    figure = drawing_figure(drive, solve_element_forces(drive, sampling.nominal(drive), 0.0))
    assert "neighbouring bores cut each other by 3.62 mm" in figure.axes[1].get_title(loc="left")
    assert not [p for p in figure.axes[0].patches if p.get_gid() == "cage"]
    assert len([line for line in figure.axes[0].lines if line.get_gid() == "wall"]) == 2 * 29


def test_exaggeration_shows_backlash_and_indentation(roomy: sm.Drive) -> None:
    """Exaggerated N times, gaps between circles and profile are N times those of the contact equations."""
    forces, row, times = loaded(roomy), 1, 50.0
    shown, true = row_outlines(roomy, forces, row, times), row_outlines(roomy, forces, row)
    members = slice(row, None, 3)
    deviations, shift = forces.deviations, forces.displacement[row]
    n_r, n_t = roomy.path.normal(forces.layout.beta[row], roomy.orientation)
    play = deviations.gear[0, members] - deviations.element[0, members] - shift[:, 0] * n_r - shift[:, 1] * n_t
    gap = distances(shown.centre, shown.gear) - shown.radius
    plain = np.abs(forces.layout.beta[row]) < roomy.usable_limit - 0.3
    assert np.abs(play[plain]).max() > 1e-6
    np.testing.assert_allclose(gap[plain & (play > 0)], times * play[plain & (play > 0)], atol=0.15 * times * 5e-6)
    pressed = plain & (forces.magnitude[row, :, 0] > 100)
    assert pressed.sum() > 5
    inside = -(times * play[pressed])
    assert (inside > 0).all()
    np.testing.assert_allclose(-gap[pressed], inside, atol=0.15 * times * 5e-6)
    assert crossings(shown.gear[::8]) == 0
    np.testing.assert_allclose(shown.radius - roomy.element_radius, times * (true.radius - roomy.element_radius))


def test_without_load_there_are_no_arrows(drive: sm.Drive) -> None:
    figure = forces_figure(drive, solve_element_forces(drive, sampling.nominal(drive), 0.0))
    assert not [c for ax in figure.axes for c in ax.collections if isinstance(c, Quiver)]
    assert not any(p.get_facecolor()[3] for ax in figure.axes for p in ax.patches if p.get_gid() == "element")


@pytest.mark.slow
def test_every_kind_of_drive_is_drawn(drawn: sm.Drive) -> None:
    forces = loaded(drawn)
    figure = forces_figure(drawn, forces)
    rows = [ax for ax in figure.axes if any(p.get_gid() == "gear" for p in ax.patches)]
    assert len(rows) == drawn.eccentrics
    assert layout_faults(figure) == []
    assert layout_faults(drawing_figure(drawn, forces)) == []


def test_wrong_input_is_refused_in_one_line(drive: sm.Drive) -> None:
    with pytest.raises(InputError, match="twist"):
        solve_element_forces(drive, sampling.nominal(drive), float("nan"))
