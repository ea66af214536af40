"""Figures of a drive to scale: the drawing with its dimensions, and the contact forces at a twist."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...drawing.drive import Drive
from ...numerics.arrays import Array
from ...units import ARCMIN
from ..style import BLUE, FAINT, GREEN, INK, RED, caption, drive_name, new_figure
from ..text_fit import fit_text, legend_columns
from .element_forces import ElementForces
from .layout import unit_vector
from .row import colour_elements, colour_map, draw_arrows, draw_row, part_handles
from .row_outlines import RowOutlines, row_outlines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def forces_figure(drive: Drive, forces: ElementForces, exaggeration: float = 1.0, individual: str = "") -> Figure:
    """All rows of a drive with the forces on their elements, a colour bar, a scale for the arrows and the drive's
    torque; individual: which one it is, for the title, empty for the drive without deviations.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    rows = drive.eccentrics
    across = min(rows, 3)
    figure = new_figure(max(5.2 * across, 7.5), 6.0 * -(-rows // 3) + 0.6)
    axes = np.atleast_1d(figure.subplots(-(-rows // 3), across)).ravel()
    greatest = float(forces.significant.max())
    for row, ax in enumerate(axes):
        if row >= rows:
            ax.set_axis_off()
            continue
        draw_row(ax, drive, row_outlines(drive, forces, row, exaggeration))
        colour_elements(ax, forces, row, greatest)
        draw_arrows(ax, drive, forces, row, greatest)
        angle = np.degrees(forces.layout.crank[row] % (2 * np.pi))
        caption(
            ax,
            f"eccentric {row + 1}, crank at {angle:.0f} deg: {forces.torque[row].sum():.4g} N.m, "
            f"{int(forces.significant[row].any(axis=-1).sum())} elements carry",
        )
    if greatest > 0:
        norm = Normalize(0, greatest)
        figure.colorbar(
            ScalarMappable(norm, colour_map()),
            ax=list(axes),
            orientation="horizontal",
            shrink=0.35,
            aspect=40,
            pad=0.02,
            label="greatest contact force of an element [N]",
        )
    title = (
        f"{drive_name(drive.name)}, {individual or 'without deviations'}: {forces.torque.sum():.4g} N.m at "
        f"{forces.twist / ARCMIN:g} arcmin, {_turning(drive)}; cage and gear held"
    )
    if exaggeration != 1:
        title += f"; deviations and displacements {exaggeration:g} times as large"
    _legend(figure, [*_force_handles(drive), *part_handles(drive, has_bars=drive.seats.wall > 0)], title)
    return figure


def _force_handles(drive: Drive) -> list[Any]:
    """Entries of a legend for the arrows and the elements without a force."""
    from matplotlib.lines import Line2D

    names = {"gear": BLUE, "crank": RED, "cage": GREEN}
    arrows = [Line2D([], [], color=colour, marker=">", label=f"force of the {name}") for name, colour in names.items()]
    empty: dict[str, Any] = {"marker": "o", "markersize": 8, "markerfacecolor": "white", "markeredgecolor": FAINT}
    return [*arrows, Line2D([], [], linestyle="none", label=f"{drive.element} that carries nothing", **empty)]


def _legend(figure: Figure, handles: list[Any], title: str = "") -> None:
    """A legend over the whole figure, with a title that breaks where the figure ends."""
    width = float(figure.get_size_inches()[0]) - 0.3
    figure.legend(
        handles=handles,
        loc="outside upper left",
        ncols=legend_columns([handle.get_label() for handle in handles], width, most=5),
        frameon=False,
        title=fit_text(title, width) or None,
        alignment="left",
        labelcolor=INK,
    )


def drawing_figure(drive: Drive, forces: ElementForces) -> Figure:
    """The first row without deviations, an enlarged lobe beside it, and the dimensions."""
    from matplotlib.lines import Line2D

    figure = new_figure(11.5, 7.4)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.45, 1), height_ratios=(1.9, 1))
    left, right, sizes = (figure.add_subplot(place) for place in (grid[:, 0], grid[0, 1], grid[1, 1]))
    row = row_outlines(drive, forces, 0)
    radius = 1e3 * drive.path.centre_distance
    around = unit_vector(np.linspace(0, 2 * np.pi, 361))
    pitch: dict[str, Any] = {"color": BLUE, "linewidth": 0.9, "dashes": (8, 2, 1, 2)}
    for ax in (left, right):
        draw_row(ax, drive, row)
        patches = [patch for patch in ax.patches if patch.get_gid() == "element"]
        for patch, exists in zip(patches, forces.usable[0], strict=True):
            patch.set_linestyle("solid" if exists else "dotted")
        ax.plot(*(radius * around.T), **pitch)
    _enlarge(right, drive, row, forces)
    sizes.set_axis_off()
    sizes.text(0, 1, "\n".join(_dimensions(drive, forces)), ha="left", va="top", color=INK, linespacing=1.5)
    caption(left, "eccentric 1, to scale")
    wall = 1e3 * drive.seats.wall
    caption(
        right,
        f"enlarged; cage bars of {wall:.3g} mm between the bores"
        if wall > 0
        else f"enlarged; the {drive.element}s overlap: neighbouring bores cut each other by {-wall:.3g} mm",
    )
    lines = [Line2D([], [], label="pitch circle", **pitch), *right.get_legend_handles_labels()[0]]
    handles = [*part_handles(drive, has_bars=wall > 0), *lines]
    _legend(figure, handles, f"{drive_name(drive.name)}, sizes without deviations")
    return figure


def _dimensions(drive: Drive, forces: ElementForces) -> list[str]:
    """The dimensions of a drive, a line each."""
    radius, e = 1e3 * drive.path.centre_distance, 1e3 * drive.eccentricity
    lines = [
        f"ratio {drive.ratio:+g}, {_turning(drive)}",
        f"{drive.lobes} lobes",
        f"{drive.elements} {drive.element}s on {drive.eccentrics} eccentric{'s' if drive.eccentrics > 1 else ''}",
        f"eccentricity {e:g} mm",
        f"pitch radius {radius:g} mm",
        f"crank radius {1e3 * drive.crank_radius:g} mm",
        f"{drive.element} diameter {2e3 * drive.element_radius:g} mm",
    ]
    if drive.element == "roller":
        lines.append(f"roller length {1e3 * drive.element_length:g} mm")
    if drive.usable_limit < np.pi:
        lines.append(f"profile cut away beyond {np.degrees(drive.usable_limit):.1f} deg of 180")
    if forces.layout.gear.any():
        turns = ", ".join(f"{turn:+.3g}" for turn in np.degrees(forces.layout.gear[1:]))
        lines.append(f"further rows' profiles turned by {turns} deg")
    return lines


def _enlarge(ax: Axes, drive: Drive, row: RowOutlines, forces: ElementForces) -> None:
    """Zoom in on the element closest to the flank's middle, and give its diameter."""
    beta = forces.layout.beta[0]
    k = int(np.abs(beta - drive.usable_limit / 2).argmin())
    centre, angle = 1e3 * row.centre[k], float(forces.layout.bore[0, k])
    r = 1e3 * drive.element_radius
    reach = max(2.2 * r, 1e3 * 2.2 * np.pi * drive.path.centre_distance / drive.lobes)
    ax.set(xlim=(centre[0] - reach, centre[0] + reach), ylim=(centre[1] - reach, centre[1] + reach))
    path = np.linspace(0, 2 * np.pi, 721 * 8)
    points = 1e3 * drive.path.point(drive.lobes * path)
    ax.plot(*points.T, color=BLUE, linewidth=1.0, label=f"path of the {drive.element}s' centres", gid="path")
    outwards, along = unit_vector(np.array([angle, angle + np.pi / 2]))
    ax.annotate(
        "",
        centre - r * along,
        centre + r * along,
        arrowprops={"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    ax.text(
        *_at(centre - 0.45 * r * outwards),
        f"\N{DIAMETER SIGN} {2 * r:g} mm",
        ha="center",
        va="center",
        color=INK,
        fontsize="small",
        zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )


def _at(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _turning(drive: Drive) -> str:
    return "crank and cage turn together" if drive.orientation > 0 else "crank and cage reverse"
