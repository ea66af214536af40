"""Pictures of a drive's rows to scale: the drawing with its sizes, and the contact forces at a twist."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..contact.element_contacts import CONTACTS
from ..drawing.drive import Drive
from ..numerics.arrays import Array
from ..units import ARCMIN
from .layout import towards
from .loads import Loads
from .shapes import Shapes, cage_room, shapes
from .style import BLUE, FAINT, GREEN, INK, METAL, RED, caption
from .style import CONTACTS as CONTACT_LINES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


GEAR_FILL, CRANK_FILL, CAGE_FILL = METAL, "#f3e3da", "#cfe8df"
RIM = 2.2
"""Width of the gear's ring outside the path, in element radii; a drawing says nothing of it."""
LONGEST = 2.0
"""Length of the greatest force's arrow, in element radii."""
ARROW_COLOURS = (CONTACT_LINES[0].colour, CONTACT_LINES[1].colour, CONTACT_LINES[2].colour, CONTACT_LINES[2].colour)
"""Gear, crank and both cage walls: blue, red, green."""


def picture_forces(drive: Drive, loads: Loads, exaggeration: float = 1.0) -> Figure:
    """All rows of a drive with the forces on their elements; colour bar, arrow scale and the drive's torque."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    rows = drive.eccentrics
    figure = Figure(figsize=(max(5.2 * min(rows, 3), 7.5), 6.0 * -(-rows // 3)), dpi=130, layout="constrained")
    axes = np.atleast_1d(figure.subplots(-(-rows // 3), min(rows, 3))).ravel()
    greatest = float(loads.carried.max())
    for row, ax in enumerate(axes):
        if row >= rows:
            ax.set_axis_off()
            continue
        draw_row(ax, drive, shapes(drive, loads, row, exaggeration))
        colour_elements(ax, loads, row, greatest)
        draw_arrows(ax, drive, loads, row, greatest)
        angle = np.degrees(loads.layout.crank[row] % (2 * np.pi))
        caption(
            ax,
            f"eccentric {row + 1} at {angle:.0f} deg: {loads.torque[row].sum():.4g} N.m, "
            f"{int(loads.carried[row].any(axis=-1).sum())} elements carry",
        )
    if greatest > 0:
        norm = Normalize(0, greatest)
        figure.colorbar(
            ScalarMappable(norm, _colours()),
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
        f"{drive.name}: {loads.torque.sum():.4g} N.m at {loads.twist / ARCMIN:g} arcmin, "
        f"{_turning(drive)}; cage and gear held"
    )
    if exaggeration != 1:
        title += f"; deviations and displacements {exaggeration:g} times as large"
    figure.legend(handles=handles, loc="outside upper left", ncols=4, frameon=False, title=title, alignment="left")
    return figure


def draw_row(ax: Axes, drive: Drive, row: Shapes) -> Axes:
    """One row in mm: gear ring, crank, cage and elements; all but the elements filled."""
    from matplotlib.patches import Circle, PathPatch, Polygon
    from matplotlib.path import Path as Outline

    # add_artist, not add_patch: finding limits from the patches, which are set below, would take most of the time.
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
    # Room for the arrows outside.
    reach = 1e3 * (drive.path.centre_distance + (1.1 + max(RIM - 1, LONGEST)) * drive.element_radius)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.set_axis_off()
    return ax


def colour_elements(ax: Axes, loads: Loads, row: int, greatest: float) -> None:
    """Elements by their greatest contact force; one that carries nothing stays empty, dotted where there is no gear."""
    force = loads.carried[row].max(axis=-1)
    elements = [patch for patch in ax.patches if patch.get_gid() == "element"]
    for patch, value, exists in zip(elements, force, loads.usable[row], strict=True):
        carries = value > 0
        patch.set(
            facecolor=_colours()(value / greatest) if carries else "none",
            edgecolor=INK if carries else FAINT,
            linestyle="solid" if exists else "dotted",
        )


def draw_arrows(ax: Axes, drive: Drive, loads: Loads, row: int, greatest: float) -> None:
    """The forces on one row's elements, tips where they act, and below the axes an arrow for scale."""
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
        some = loads.carried[row, :, k] > 0
        x, y = 1e3 * loads.point[row, some, k].T
        across, up = loads.force[row, some, k].T
        ax.quiver(x, y, across, up, color=colour, gid=name, **style)
    size = _round_below(greatest)
    low, left = 0.97 * ax.get_ylim()[0], 0.99 * ax.get_xlim()[0]
    style["pivot"] = "tail"
    ax.quiver([left], [low], [size], [0.0], color=INK, gid="scale", **style)
    ax.text(left, low + 0.4e3 * drive.element_radius, f"{size:g} N", color=INK, fontsize="small", ha="left")


def picture_drawing(drive: Drive, loads: Loads) -> Figure:
    """The first row with its sizes, as a designer reads them, and beside it one lobe enlarged."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 6.6), dpi=130, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.45, 1))
    row = shapes(drive, loads, 0)
    for ax in (left, right):
        draw_row(ax, drive, row)
        patches = [patch for patch in ax.patches if patch.get_gid() == "element"]
        for patch, exists in zip(patches, loads.usable[0], strict=True):
            patch.set_linestyle("solid" if exists else "dotted")
    radius, e = 1e3 * drive.path.centre_distance, 1e3 * drive.eccentricity
    around = towards(np.linspace(0, 2 * np.pi, 361))
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
    if loads.layout.gear.any():
        turns = ", ".join(f"{turn:+.3g}" for turn in np.degrees(loads.layout.gear[1:]))
        lines.append(f"further rows' profiles turned by {turns} deg")
    left.text(0, -0.1 * radius, "\n".join(lines), ha="center", va="top", color=INK, fontsize="small", linespacing=1.5)
    _enlarge(right, drive, row, loads)
    caption(left, f"{drive.name}: eccentric 1, to scale")
    wall = 1e3 * drive.seats.wall
    caption(
        right,
        f"cage bars of {wall:.3g} mm between the bores"
        if wall > 0
        else f"the elements overlap: neighbouring bores cut each other by {-wall:.3g} mm",
    )
    return figure


def _enlarge(ax: Axes, drive: Drive, row: Shapes, loads: Loads) -> None:
    """Zoom on the element nearest the flank's middle, with the sizes that decide its contacts."""
    beta = loads.layout.beta[0]
    k = int(np.abs(beta - drive.usable_limit / 2).argmin())
    centre, angle = 1e3 * row.centre[k], float(loads.layout.bore[0, k])
    r, inner = 1e3 * drive.element_radius, 1e3 * cage_room(drive)[0]
    reach = max(2.2 * r, 1e3 * 2.2 * np.pi * drive.path.centre_distance / drive.lobes)
    ax.set(xlim=(centre[0] - reach, centre[0] + reach), ylim=(centre[1] - reach, centre[1] + reach))
    path = np.linspace(0, 2 * np.pi, 721 * 8)
    points = 1e3 * drive.path.point(drive.lobes * path)
    ax.plot(*points.T, color=BLUE, linewidth=1.0, label="path of the centres", gid="path")
    ax.plot(*centre, marker="+", color=BLUE, markersize=8)
    outwards, along = towards(np.array([angle, angle + np.pi / 2]))
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
            *_at(at * towards(np.asarray(angle + aside))),
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


def _colours() -> Any:
    from matplotlib import colormaps

    return colormaps["YlOrBr"].resampled(256)


def _closed(points: Array) -> Any:
    from matplotlib.path import Path as Outline

    # Clockwise, against the rim's circle: what lies between is filled.
    return Outline(1e3 * np.concatenate([points[::-1], points[-1:]]), closed=True)


def _round_below(value: float) -> float:
    """The greatest of 1, 2, 5 times a power of ten that is not above `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value))
