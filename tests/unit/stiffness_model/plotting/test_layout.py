"""The pictures of every preset: texts lie inside the figure, apart from each other and clear of lines."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

import stiffness_model as sm
from stiffness_model.catalog.gears import catalog
from stiffness_model.drawing import sampling
from stiffness_model.kinds import CONTACT_FORCES, AnyDrive, lacking
from stiffness_model.plotting import curves as plots
from stiffness_model.plotting.cross_section.drive_figures import drawing_figure, forces_figure
from stiffness_model.plotting.cross_section.element_forces import solve_element_forces
from stiffness_model.plotting.style import format_axes, label_ends, legend_above, new_axes
from tests.picture_layout import layout_faults


def figure_of(ax: object) -> Figure:
    return ax.get_figure(root=True)  # type: ignore[attr-defined, no-any-return]


def curve_figures(drive: AnyDrive) -> dict[str, Figure]:
    """Every picture that `reefmu curve` and `reefmu compare` draw of a drive, from few virtual drives."""
    population = sm.simulate(drive, np.linspace(0, drive.max_twist, 13), 6)
    curve = population.curve()
    axes = {
        "twist": plots.twist_over_torque(curve),
        "stiffness": plots.stiffness_over_torque(curve),
        "gears": plots.against_catalog(curve, catalog()),
    }
    if not lacking(drive, CONTACT_FORCES):
        axes |= {"forces": plots.contact_forces(population), "share": plots.load_share(population)}
    return {name: figure_of(ax) for name, ax in axes.items()}


def drive_figures(drive: sm.Drive) -> dict[str, Figure]:
    """Every picture that `reefmu draw` makes of a drive, and that of the gear."""
    nominal = sampling.nominal(drive)
    return {
        "drawing": drawing_figure(drive, solve_element_forces(drive, nominal, 0.0)),
        "contact forces": forces_figure(
            drive, solve_element_forces(drive, nominal, drive.max_twist), 20, "individual 7"
        ),
        "gear": figure_of(plots.gear_profile(drive)),
        "row": figure_of(drive.plot()),
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", [*sm.presets(), "CHA-40A-50"])
def test_texts_of_the_pictures_of_every_preset_do_not_collide(name: str) -> None:
    drive = sm.load_drive(name)
    figures = curve_figures(drive) | (drive_figures(drive) if isinstance(drive, sm.Drive) else {})
    assert {name: faults for name, figure in figures.items() if (faults := layout_faults(figure))} == {}


def test_a_band_is_explained_only_where_one_is_drawn() -> None:
    sheet = plots.twist_over_torque(sm.simulate(sm.load_drive("CHA-40A-50"), np.linspace(0, 1e-3, 5), 1).curve())
    legend = sheet.get_legend()
    assert legend is not None
    assert "shaded" not in legend.get_title().get_text()


@pytest.mark.parametrize(
    ("text", "at", "fault"),
    [
        ("beyond the edge of the figure", (0.9, 0.5), "leaves the figure"),
        ("on the line", (0.4, 0.5), "is crossed by"),
        ("over another one", (0.3, 0.9), "overlap"),
    ],
)
def test_the_check_of_the_layout_finds_faults(text: str, at: tuple[float, float], fault: str) -> None:
    ax = format_axes(new_axes(), "x", "y")
    ax.plot([0, 1], [0.5, 0.5])
    ax.text(0.32, 0.91, "a text", transform=ax.transAxes)
    ax.set(xlim=(0, 1), ylim=(0, 1))
    assert layout_faults(figure_of(ax)) == []
    ax.text(*at, text, transform=ax.transAxes, va="center").set_in_layout(False)
    assert any(fault in line for line in layout_faults(figure_of(ax)))


def test_a_legend_over_a_line_is_found_and_one_above_the_axes_is_not() -> None:
    ax = format_axes(new_axes(), "x", "y")
    for k in range(7):
        ax.plot([0, 1], [k, k], label=f"a line with a rather long label, number {k}")
    ax.legend(loc="center")
    assert any("legend covers" in line for line in layout_faults(figure_of(ax)))
    legend_above(ax, "a title that is much too long for one line " * 4)
    assert layout_faults(figure_of(ax)) == []


def test_labels_at_the_ends_stay_inside_the_figure() -> None:
    ax = format_axes(new_axes(), "x", "y")
    ax.set(xlim=(0, 1), ylim=(0, 1))
    label_ends(ax, [(1, 0.5, "a longer label", "k"), (1, 0.51, "another label", "k")])
    assert layout_faults(figure_of(ax)) == []
