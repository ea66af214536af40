"""Figures of a drive to scale: the drawing with its dimensions, and the contact forces at a twist."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...drawing.drive import Drive
from ...numerics.arrays import Array
from ...units import ARCMIN
from ..style import BLUE, FAINT, GREEN, INK, RED, caption
from .element_forces import ElementForces
from .layout import unit_vector
from .row import colour_elements, colour_map, draw_arrows, draw_row
from .row_outlines import RowOutlines, cage_radii, row_outlines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def forces_figure(drive: Drive, forces: ElementForces, exaggeration: float = 1.0) -> Figure:
    """All rows of a drive with the forces on their elements, a colour bar, a scale for the arrows and the drive's
    torque.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    rows = drive.eccentrics
    figure = Figure(figsize=(max(5.2 * min(rows, 3), 7.5), 6.0 * -(-rows // 3)), dpi=130, layout="constrained")
    axes = np.atleast_1d(figure.subplots(-(-rows // 3), min(rows, 3))).ravel()
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
            f"eccentric {row + 1} at {angle:.0f} deg: {forces.torque[row].sum():.4g} N.m, "
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
    names = {"gear": BLUE, "crank": RED, "cage": GREEN}
    handles = [Line2D([], [], color=colour, marker=">", label=f"force of the {name}") for name, colour in names.items()]
    handles.append(
        Line2D(
            [],
            [],
            linestyle="none",
            marker="o",
            markerfacecolor="white",
            markeredgecolor=FAINT,
            label="carries nothing (dotted: profile cut away)",
        )
    )
    title = (
        f"{drive.name}: {forces.torque.sum():.4g} N.m at {forces.twist / ARCMIN:g} arcmin, "
        f"{_turning(drive)}; cage and gear held"
    )
    if exaggeration != 1:
        title += f"; deviations and displacements {exaggeration:g} times as large"
    figure.legend(handles=handles, loc="outside upper left", ncols=4, frameon=False, title=title, alignment="left")
    return figure


def drawing_figure(drive: Drive, forces: ElementForces) -> Figure:
    """The first row with its dimensions, and an enlarged lobe beside it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 6.6), dpi=130, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.45, 1))
    row = row_outlines(drive, forces, 0)
    for ax in (left, right):
        draw_row(ax, drive, row)
        patches = [patch for patch in ax.patches if patch.get_gid() == "element"]
        for patch, exists in zip(patches, forces.usable[0], strict=True):
            patch.set_linestyle("solid" if exists else "dotted")
    radius, e = 1e3 * drive.path.centre_distance, 1e3 * drive.eccentricity
    around = unit_vector(np.linspace(0, 2 * np.pi, 361))
    for ax in (left, right):
        ax.plot(*(radius * around.T), color=BLUE, linewidth=0.9, dashes=(8, 2, 1, 2), label="pitch circle")
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
        lines.append(f"profile cut away beyond {np.degrees(drive.usable_limit):.1f} deg of 180 (dotted)")
    if forces.layout.gear.any():
        turns = ", ".join(f"{turn:+.3g}" for turn in np.degrees(forces.layout.gear[1:]))
        lines.append(f"further rows' profiles turned by {turns} deg")
    left.text(0, -0.1 * radius, "\n".join(lines), ha="center", va="top", color=INK, fontsize="small", linespacing=1.5)
    _enlarge(right, drive, row, forces)
    caption(left, f"{drive.name}: eccentric 1, to scale")
    wall = 1e3 * drive.seats.wall
    caption(
        right,
        f"cage bars of {wall:.3g} mm between the bores"
        if wall > 0
        else f"the elements overlap: neighbouring bores cut each other by {-wall:.3g} mm",
    )
    return figure


def _enlarge(ax: Axes, drive: Drive, row: RowOutlines, forces: ElementForces) -> None:
    """Zoom in on the element closest to the flank's middle, and annotate its contacts."""
    beta = forces.layout.beta[0]
    k = int(np.abs(beta - drive.usable_limit / 2).argmin())
    centre, angle = 1e3 * row.centre[k], float(forces.layout.bore[0, k])
    r, inner = 1e3 * drive.element_radius, 1e3 * cage_radii(drive)[0]
    reach = max(2.2 * r, 1e3 * 2.2 * np.pi * drive.path.centre_distance / drive.lobes)
    ax.set(xlim=(centre[0] - reach, centre[0] + reach), ylim=(centre[1] - reach, centre[1] + reach))
    path = np.linspace(0, 2 * np.pi, 721 * 8)
    points = 1e3 * drive.path.point(drive.lobes * path)
    ax.plot(*points.T, color=BLUE, linewidth=1.0, label="path of the centres", gid="path")
    ax.plot(*centre, marker="+", color=BLUE, markersize=8)
    outwards, along = unit_vector(np.array([angle, angle + np.pi / 2]))
    ax.annotate(
        "",
        centre - r * along,
        centre + r * along,
        arrowprops={"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    ax.text(
        *_at(centre - 0.45 * r * outwards),
        f"\N{DIAMETER SIGN} {2 * r:g}",
        ha="center",
        va="center",
        color=INK,
        fontsize="small",
    )
    middle = 1e3 * drive.path.centre_distance
    between = np.pi / drive.transmission_ratio
    for name, at, aside, colour in (
        ("gear", middle + 1.6 * r, 0.0, INK),
        ("crank", inner - 0.9 * r, 0.0, RED),
        ("cage", middle, between, GREEN),
    ):
        ax.text(
            *_at(at * unit_vector(np.asarray(angle + aside))),
            name,
            ha="center",
            va="center",
            color=colour,
            fontsize="small",
            clip_on=True,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.5},
        )
    ax.legend(loc="lower right", frameon=True, framealpha=0.9, edgecolor="none", fontsize="small")


def _at(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _turning(drive: Drive) -> str:
    return "crank and cage turn together" if drive.orientation > 0 else "crank and cage reverse"
