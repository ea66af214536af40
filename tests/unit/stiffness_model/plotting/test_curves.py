"""Pictures show the given data and units, and their legends do not cover data."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import stiffness_model as sm
from stiffness_model import ARCMIN
from stiffness_model.catalog.gears import CatalogGear, catalog
from stiffness_model.montecarlo.population import Population
from stiffness_model.montecarlo.virtual_drives import LOW_TORQUE_SHARE
from stiffness_model.plotting import curves as plots
from stiffness_model.plotting.style import CONTACTS, DRIVES, Line, label_ends, new_axes

RANGES = {"drive_1": 8, "drive_2": 8, "drive_3": 40}


@pytest.fixture(scope="module")
def populations() -> list[Population]:
    return [sm.simulate(sm.load_drive(name), ARCMIN * np.linspace(0, twist, 17), 48) for name, twist in RANGES.items()]


def data(ax: Axes, label: str) -> np.ndarray:
    """The points (2, n) of the curve with that label."""
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return np.array([line.get_xdata(), line.get_ydata()], float)


def drawn(ax: Axes) -> Axes:
    """The axes after drawing, when all sizes are final."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    FigureCanvasAgg(figure).draw()
    return ax


def legend_is_off_the_data(ax: Axes) -> bool:
    legend = drawn(ax).get_legend()
    assert legend is not None
    return not legend.get_window_extent().overlaps(ax.get_window_extent().padded(-2))


def is_inside_the_figure(ax: Axes) -> bool:
    figure = drawn(ax).get_figure(root=True)
    assert figure is not None
    box, whole = figure.get_tightbbox(), figure.get_size_inches()
    return bool(box.x0 > -0.05 and box.y0 > -0.05 and box.x1 < whole[0] + 0.05 and box.y1 < whole[1] + 0.05)


def test_twist_over_torque_draws_means_and_bands(populations: list[Population]) -> None:
    curves = [population.curve() for population in populations]
    ax = plots.twist_over_torque(curves)
    for curve in curves:
        x, y = data(ax, curve.name.replace("_", " "))
        np.testing.assert_allclose(x, curve.torque)
        np.testing.assert_allclose(y, curve.twist / ARCMIN)
        edges = [np.asarray(line.get_xdata(), float) for line in ax.lines]
        for edge in (curve.torque_p10, curve.torque_p90):
            assert any(len(e) == len(edge) and np.allclose(e, edge) for e in edges)
    assert ax.get_xlabel() == "torque at the output [N.m]"
    assert ax.get_ylabel() == "twist at the output [arcmin]"
    assert len(ax.collections) == 3  # one band each
    colours = [line.get_color() for line in ax.lines if not str(line.get_label()).startswith("_")]
    assert colours == [line.colour for line in DRIVES[:3]]
    assert legend_is_off_the_data(ax)
    assert is_inside_the_figure(ax)


@pytest.mark.parametrize("lines", [DRIVES, CONTACTS])
def test_lines_differ_in_colour_and_in_dashes(lines: tuple[Line, ...]) -> None:
    assert len({line.colour for line in lines}) == len({line.dashes for line in lines}) == len(lines)


def test_against_catalog_draws_the_gears_with_a_curve(populations: list[Population]) -> None:
    curve = populations[0].curve()
    small = CatalogGear("Own", "Small", "rig", stiffness=20 / ARCMIN, rated_torque=50)
    gears = [*catalog(), small]
    ax = plots.against_catalog(curve, gears)
    x, y = data(ax, "Harmonic Drive\nCHA-40A (ratio 50)")
    np.testing.assert_allclose(y, gears[0].twist_at(x) / ARCMIN)
    assert {54.0, 196.0} <= set(x)  # the breakpoints
    assert x[-1] == pytest.approx(curve.full_torque)
    x, y = data(ax, "Own\nSmall")
    assert x[-1] == 50  # no further than its row permits
    assert y[-1] == pytest.approx(2.5)
    named = [line.get_label() for line in ax.lines if not str(line.get_label()).startswith("_")]
    assert len(named) == 1 + sum(gear.has_curve for gear in gears)
    assert "arcmin" in ax.get_ylabel()
    assert legend_is_off_the_data(ax)
    assert is_inside_the_figure(ax)


def test_stiffness_over_torque(populations: list[Population]) -> None:
    curve = populations[1].curve()
    ax = plots.stiffness_over_torque(curve)
    np.testing.assert_allclose(data(ax, "drive 2"), [curve.torque, curve.stiffness * ARCMIN])
    assert ax.get_ylabel() == "stiffness [N.m/arcmin]"
    assert legend_is_off_the_data(ax)


def test_contact_forces_draw_mean_and_percentiles_of_the_drives(populations: list[Population]) -> None:
    population = populations[1]
    ax = plots.contact_forces(population)
    torque = population.torque.mean(axis=0)
    for k, name in enumerate(Population.contact_names):
        np.testing.assert_allclose(data(ax, name), [torque, population.contact_force[..., k].mean(axis=0)])
        bars = np.array([path.vertices for path in ax.collections[k].get_paths()])
        ends = np.percentile(population.contact_force[..., k], (10, 90), axis=0)
        for end, expected in enumerate(ends):
            np.testing.assert_allclose(bars[:, end, 1], np.interp(bars[:, 0, 0], torque, expected))
    # Bars of different contacts stand beside each other.
    places = np.sort(np.concatenate([[path.vertices[0, 0] for path in c.get_paths()] for c in ax.collections]))
    assert len(places) == len(Population.contact_names) * plots.WHISKERS
    assert np.diff(places).min() > 0.9 * torque[-1] / len(places)
    assert ax.get_ylabel() == "greatest contact force [N]"
    assert ax.get_ylim()[0] == 0
    assert is_inside_the_figure(ax)
    boxes = [text.get_window_extent() for text in ax.texts]
    assert sorted(text.get_text() for text in ax.texts) == sorted(Population.contact_names)
    for k, box in enumerate(boxes):
        assert box.x0 >= ax.get_window_extent().x1  # beside the data
        assert not any(box.overlaps(other) for other in boxes[k + 1 :])


def test_labels_at_the_ends_of_close_curves_do_not_overlap() -> None:
    ax = new_axes()
    ax.set_xlim(0, 1)
    ax.set_ylim(0, 10)
    texts = label_ends(ax, [(1, y, name, "k") for y, name in ((5.0, "b"), (5.05, "c"), (4.98, "a"), (9.0, "d"))])
    drawn(ax)
    boxes = [text.get_window_extent() for text in texts]
    assert [text.get_text() for text in texts] == ["a", "b", "c", "d"]  # from the lowest upwards
    assert all(lower.y1 <= upper.y0 for lower, upper in pairwise(boxes))
    assert texts[-1].xy[1] == 9.0  # a label far enough from the others is not shifted


def test_shared_axes_show_the_forces_of_all(populations: list[Population]) -> None:
    figure = Figure(figsize=(12, 4), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    for ax, population in zip(axes, populations, strict=True):
        assert plots.contact_forces(population, ax) is ax
    greatest = max(np.percentile(population.contact_force, 90, axis=0).max() for population in populations)
    assert all(ax.get_ylim()[1] > greatest for ax in axes)


def test_load_share_leaves_out_the_low_torque_region(populations: list[Population]) -> None:
    ax = plots.load_share(populations)
    for population in populations:
        x, y = data(ax, population.drive.name.replace("_", " "))
        torque = population.torque.mean(axis=0)
        kept = torque >= LOW_TORQUE_SHARE * torque[-1]
        assert 0 < kept.sum() < len(torque)
        np.testing.assert_allclose(x, torque[kept])
        np.testing.assert_allclose(y, 100 * population.load_share[:, kept].mean(axis=0))
    assert "[%]" in ax.get_ylabel()
    legend = ax.get_legend()
    assert legend is not None
    assert f"below {100 * LOW_TORQUE_SHARE:g} %" in legend.get_title().get_text()
    assert legend_is_off_the_data(ax)
    assert is_inside_the_figure(ax)


def test_load_share_leaves_out_torques_that_some_drives_do_not_carry() -> None:
    """Printed gears differ in play, so that some carry nothing where others carry a third of the greatest torque."""
    drive = sm.load_drive("printed_cycloidal")
    population = sm.simulate(drive, drive.max_twist * np.linspace(0, 1, 13), 24)
    carried = np.isfinite(population.load_share).all(axis=0)
    assert (population.representative & ~carried).any()
    ax = plots.load_share(population)
    x, y = data(ax, "printed cycloidal")
    np.testing.assert_allclose(x, population.torque[:, carried & population.representative].mean(axis=0))
    assert np.isfinite(y).all()
    legend = ax.get_legend()
    assert legend is not None
    title = legend.get_title().get_text()
    assert f"below {100 * LOW_TORQUE_SHARE:g} % of the greatest, or that some drives do not carry, left out" in title
    assert is_inside_the_figure(ax)


def test_twists_in_any_order_give_the_same_curve(populations: list[Population]) -> None:
    twist = populations[0].twist
    mixed = sm.simulate(populations[0].drive, np.concatenate([twist[8:], twist[:8]]), 48)
    for function in (plots.contact_forces, plots.load_share):
        name = "gear" if function is plots.contact_forces else "drive 1"
        np.testing.assert_allclose(
            data(function(mixed), name), data(function(populations[0]), name), rtol=1e-6, atol=1e-6
        )


@pytest.mark.parametrize("lobes", [28, 30])
def test_gear_profile_is_to_scale_and_shows_what_is_cut_away(lobes: int) -> None:
    drive = sm.load_drive("drive_1", lobes=lobes)
    ax = plots.gear_profile(drive)
    assert ax.get_aspect() == 1
    assert "[mm]" in ax.get_xlabel()
    assert "[mm]" in ax.get_ylabel()
    path = data(ax, "path of the centres")
    profile = data(ax, "gear profile")
    # The profile is the equidistant of the path: no point is closer than the element's radius.
    distance = np.hypot(profile[0][:, None] - path[0], profile[1][:, None] - path[1])
    assert distance.min() == pytest.approx(7, abs=1e-3)
    # The remaining parts of two lobes meet at their intersection.
    np.testing.assert_allclose(profile[:, 720], profile[:, 721], atol=1e-6)
    # The part that is cut away starts there.
    cut = data(ax, "cut away: carries nothing")
    assert np.hypot(cut[0], cut[1]).max() < np.hypot(profile[0], profile[1]).max()
    # The elements touch the profile from the inside.
    assert len(ax.patches) >= 3  # metal and two elements
    for circle in ax.patches[1:]:
        centre = np.asarray(circle.get_center())  # type: ignore[attr-defined]
        assert np.hypot(profile[0] - centre[0], profile[1] - centre[1]).min() == pytest.approx(7, abs=1e-2)
    assert legend_is_off_the_data(ax)
    assert is_inside_the_figure(ax)


def test_a_profile_without_intersections_is_not_cut() -> None:
    drive = sm.load_drive("drive_1", eccentricity="0.2 mm", element_radius="2 mm")
    assert drive.usable_limit == np.pi
    ax = plots.gear_profile(drive)
    assert "cut away: carries nothing" not in [line.get_label() for line in ax.lines]
    assert is_inside_the_figure(ax)


def test_empty_lists_are_refused() -> None:
    with pytest.raises(sm.InputError, match="at least one curve"):
        plots.twist_over_torque([])
    with pytest.raises(sm.InputError, match="at least one population"):
        plots.load_share([])


def test_given_axes_are_used_and_the_picture_is_saved(populations: list[Population], tmp_path: Path) -> None:
    ax = Figure().add_subplot()
    assert plots.twist_over_torque(populations[0].curve(), ax) is ax
    plots.save(ax, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_drive_without_torque_can_be_drawn() -> None:
    loose = sm.simulate(sm.load_drive("drive_1"), ARCMIN * np.linspace(0, 1, 5), 8, clearance=1e-3)
    assert loose.torque.max() == 0
    for ax in (plots.contact_forces(loose), plots.load_share(loose), plots.twist_over_torque(loose.curve())):
        drawn(ax)
