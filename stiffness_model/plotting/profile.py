"""The gear drawn to scale: profile, path of the elements' centres, elements, and the part that is cut away."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..drawing.drive import Drive
from ..numerics.arrays import Array
from .style import BLUE, FAINT, INK, METAL, RED, drive_name, format_axes, legend_above, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def gear_profile(drive: Drive, ax: Axes | None = None, lobes: int = 2) -> Axes:
    """Some lobes of the ring gear to scale, in mm: profile, ball path, elements, and the part that is cut away.

    The profile intersects itself between two lobes (`Drive.usable_limit`); the part beyond the intersection does not
    exist, and elements there carry no load.
    """
    ax = new_axes(width=6.8, height=5.0) if ax is None else ax
    path, limit, q = drive.path, drive.usable_limit, drive.element_radius
    pitch = 2 * np.pi / drive.lobes
    turns = (np.arange(lobes) - (lobes - 1) / 2) * pitch
    kept, lost = np.linspace(-limit, limit, 721), np.linspace(limit, np.pi, 361)
    gear = np.hstack([_upright(path.point(kept, q), turn) for turn in turns])
    rim = 1.05 * float(np.hypot(*gear).max())
    ends = np.arctan2(gear[1, [-1, 0]], gear[0, [-1, 0]])
    angle = np.linspace(ends[0], ends[1], 361)
    ax.fill(*np.hstack([gear, rim * np.stack([np.cos(angle), np.sin(angle)])]), color=METAL, linewidth=0)
    _elements(ax, drive, float(turns[0]), lobes * pitch / 2)
    for k, turn in enumerate(turns):
        ax.plot(
            *_upright(path.point(kept), turn), color=BLUE, linewidth=1.6, label=None if k else "path of the centres"
        )
        for side in (-1, 1) if limit < np.pi else ():
            for offset in (0.0, q):
                named = k == 0 and side > 0 and offset == 0
                ax.plot(
                    *_upright(path.point(side * lost, offset), turn),
                    color=RED,
                    linewidth=1.4,
                    linestyle=(0, (3, 1.2)),
                    label="cut away: carries nothing" if named else None,
                )
    ax.plot(*gear, color=INK, linewidth=2.0, label="gear profile")
    ax.plot([], [], "o", markersize=9, markerfacecolor="none", markeredgecolor=FAINT, label=f"{drive.element}s")
    ax.plot([], [], "+", markersize=7, color=BLUE, label=f"centres of {drive.element}s")
    format_axes(ax, "across [mm]", "from the drive's axis [mm]")
    ax.set_aspect("equal")
    ax.set_ylim(bottom=1e3 * (drive.path.centre_distance - drive.eccentricity - 0.5 * q))
    ax.margins(x=0.02)
    exists = "whole" if limit >= np.pi else f"it exists up to {np.degrees(limit):.1f} deg of 180 from a lobe's middle"
    return legend_above(
        ax,
        f"{drive_name(drive.name)}: profile of {lobes} of {drive.lobes} lobes, {exists};\n"
        f"{drive.elements_per_row} {drive.element}s of {2e3 * q:g} mm on one eccentric, at most "
        f"{drive.seats.max_elements()} fit",
    )


def _upright(points: Array, turn: float) -> Array:
    """Points (n, 2) in m, rotated by `turn` rad and then so that the middle points upwards: (2, n) in mm."""
    cos, sin = np.cos(turn + np.pi / 2), np.sin(turn + np.pi / 2)
    x, y = 1e3 * points.T
    return np.stack([x * cos - y * sin, x * sin + y * cos])


def _elements(ax: Axes, drive: Drive, lobe: float, half_width: float) -> None:
    """Draw the elements of one eccentric within +-half_width rad, one of them half-way up the flank of the `lobe`."""
    from matplotlib.patches import Circle

    step = 2 * np.pi / drive.elements_per_row
    first = lobe + drive.usable_limit / 2 / drive.lobes
    for angle in first + step * np.arange(-drive.elements_per_row // 2, drive.elements_per_row // 2 + 1):
        if abs(angle) > half_width:
            continue
        radius = 1e3 * float(drive.path.radius(drive.lobes * (angle - lobe)))
        centre = (radius * np.cos(angle + np.pi / 2), radius * np.sin(angle + np.pi / 2))
        ax.add_patch(Circle(centre, 1e3 * drive.element_radius, fill=False, edgecolor=FAINT, linewidth=1.2))
        ax.plot(*centre, marker="+", color=BLUE, markersize=7)
