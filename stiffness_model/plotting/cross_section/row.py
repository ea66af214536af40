"""One row of a drive to scale: its parts, its elements coloured by force, and the contact forces as arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...contact.element_contacts import CONTACTS
from ...drawing import sampling
from ...drawing.drive import Drive
from ...numerics.arrays import Array
from ..style import CONTACTS as CONTACT_LINES
from ..style import FAINT, GREEN, INK, METAL, RED, caption, drive_name, new_axes
from .element_forces import ElementForces, solve_element_forces
from .row_outlines import RowOutlines, row_outlines

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GEAR_FILL, CRANK_FILL, CAGE_FILL = METAL, "#f3e3da", "#cfe8df"
RIM = 2.2
"""Width of the gear's ring outside the path, in element radii; for the picture only, since a drawing does not state it.
"""
LONGEST = 2.0
"""Length of the greatest force's arrow, in element radii."""
ARROW_COLOURS = (CONTACT_LINES[0].colour, CONTACT_LINES[1].colour, CONTACT_LINES[2].colour, CONTACT_LINES[2].colour)
"""Gear, crank and both cage walls: blue, red, green."""


def draw_row(ax: Axes, drive: Drive, row: RowOutlines) -> Axes:
    """Draw one row in mm: gear ring, crank and cage filled, elements as circles."""
    from matplotlib.patches import Circle, PathPatch, Polygon
    from matplotlib.path import Path as Outline

    # add_artist skips the search for axis limits, which are set below and would take most of the time.
    rim = 1e3 * (drive.path.centre_distance + RIM * drive.element_radius)
    ring = [Outline.circle((0, 0), rim), _closed(row.gear)]
    ax.add_artist(
        PathPatch(Outline.make_compound_path(*ring), facecolor=GEAR_FILL, edgecolor=INK, linewidth=1.0, gid="gear")
    )
    ax.add_artist(Polygon(1e3 * row.crank, facecolor=CRANK_FILL, edgecolor=INK, linewidth=1.0, gid="crank"))
    for polygon in row.bars:
        ax.add_artist(Polygon(1e3 * polygon, facecolor=CAGE_FILL, edgecolor=GREEN, linewidth=0.8, gid="cage"))
    if len(row.bars) < len(row.centre):
        for wall in row.walls.reshape(-1, 2, 2):
            ax.plot(*(1e3 * wall.T), color=GREEN, linewidth=0.6, gid="wall")
    for centre, radius in zip(row.centre, row.radius, strict=True):
        ax.add_artist(
            Circle(tuple(1e3 * centre), 1e3 * radius, facecolor="none", edgecolor=INK, linewidth=0.9, gid="element")
        )
    ax.plot(0, 0, marker="+", color=INK, markersize=9, gid="axis")
    ax.plot(*(1e3 * row.eccentric), marker=".", color=RED, markersize=5, gid="eccentric")
    # Leave room for the arrows.
    reach = 1e3 * (drive.path.centre_distance + (1.1 + max(RIM - 1, LONGEST)) * drive.element_radius)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.set_axis_off()
    return ax


def drive_row(drive: Drive, ax: Axes | None = None) -> Axes:
    """The first row of a drive without deviations and load, to scale."""
    ax = new_axes(width=5.0, height=5.0) if ax is None else ax
    unloaded = solve_element_forces(drive, sampling.nominal(drive), 0.0)
    draw_row(ax, drive, row_outlines(drive, unloaded, 0))
    colour_elements(ax, unloaded, 0, 0.0)
    ax.legend(
        handles=part_handles(drive, has_bars=drive.seats.wall > 0),
        loc="upper center",
        bbox_to_anchor=(0.5, 0.03),
        ncols=3,
        frameon=False,
        fontsize="small",
        labelcolor=INK,
    )
    wall = 1e3 * drive.seats.wall
    bars = f"cage bars of {wall:.3g} mm" if wall > 0 else f"bores overlap by {-wall:.3g} mm"
    return caption(ax, f"{drive_name(drive.name)}: {drive.lobes} lobes, ratio {drive.ratio:+g}, {bars}")


def part_handles(drive: Drive, *, has_bars: bool) -> list[Any]:
    """Entries of a legend that name the parts and marks of `draw_row`; has_bars: whether the cage has bars between its
    bores, else only the walls of the bores are drawn."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def mark(kind: str, size: float, label: str, **look: Any) -> Line2D:
        return Line2D([], [], linestyle="none", marker=kind, markersize=size, label=label, **look)

    cage = (
        Patch(facecolor=CAGE_FILL, edgecolor=GREEN, label="cage")
        if has_bars
        else Line2D([], [], color=GREEN, linewidth=0.6, label="walls of the cage's bores")
    )
    handles = [
        Patch(facecolor=GEAR_FILL, edgecolor=INK, label="gear"),
        Patch(facecolor=CRANK_FILL, edgecolor=INK, label="crank"),
        cage,
        mark("+", 9, "axis of the drive", color=INK),
        mark(".", 5, "centre of the eccentric", color=RED),
    ]
    if drive.usable_limit < np.pi:
        text = f"{drive.element}, profile cut away"
        handles.append(Line2D([], [], color=FAINT, linestyle="dotted", linewidth=0.9, label=text))
    return handles


def colour_elements(ax: Axes, forces: ElementForces, row: int, greatest: float) -> None:
    """Colour elements by their greatest contact force; unloaded ones are empty, dotted beyond the profile."""
    force = forces.significant[row].max(axis=-1)
    elements = [patch for patch in ax.patches if patch.get_gid() == "element"]
    for patch, value, exists in zip(elements, force, forces.usable[row], strict=True):
        carries = value > 0
        patch.set(
            facecolor=colour_map()(value / greatest) if carries else "none",
            edgecolor=INK if carries else FAINT,
            linestyle="solid" if exists else "dotted",
        )


def draw_arrows(ax: Axes, drive: Drive, forces: ElementForces, row: int, greatest: float) -> None:
    """Draw the forces on one row's elements with the tips at the contacts, and an arrow for scale below."""
    if greatest == 0:
        return
    per_mm = greatest / (1e3 * LONGEST * drive.element_radius)
    style: dict[str, Any] = {
        "angles": "xy",
        "scale_units": "xy",
        "scale": per_mm,
        "units": "xy",
        "pivot": "tip",
        "width": 0.09e3 * drive.element_radius,
        "headwidth": 3.5,
        "headlength": 4,
        "headaxislength": 3.6,
        "minlength": 0.0,
        "minshaft": 1.0,
        "zorder": 5,
    }
    for k, (name, colour) in enumerate(zip(CONTACTS, ARROW_COLOURS, strict=True)):
        some = forces.significant[row, :, k] > 0
        x, y = 1e3 * forces.point[row, some, k].T
        across, up = forces.force[row, some, k].T
        ax.quiver(x, y, across, up, color=colour, gid=name, **style)
    size = _round_below(greatest)
    low, left = 0.97 * ax.get_ylim()[0], 0.99 * ax.get_xlim()[0]
    style["pivot"] = "tail"
    ax.quiver([left], [low], [size], [0.0], color=INK, gid="scale", **style)
    ax.text(left, low + 0.4e3 * drive.element_radius, f"{size:g} N", color=INK, fontsize="small", ha="left")


def colour_map() -> Any:
    from matplotlib import colormaps

    return colormaps["YlOrBr"].resampled(256)


def _closed(points: Array) -> Any:
    from matplotlib.path import Path as Outline

    # Clockwise, opposite to the rim's circle, so that the area between is filled.
    return Outline(1e3 * np.concatenate([points[::-1], points[-1:]]), closed=True)


def _round_below(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that does not exceed `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value))
