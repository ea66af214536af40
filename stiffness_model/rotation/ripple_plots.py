"""Pictures of an individual that turns. Every function draws on `ax`, or on new axes, and returns them.

Torques in N.m, angles in arcmin at the output, the rotation in turns of the crank. matplotlib is imported when a
picture is drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..plotting.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    drive_name,
    format_axes,
    legend_above,
    new_axes,
    tint,
)
from ..units import ARCMIN
from .loaded import LoadedTurn, NoLoad
from .maps import TurningMap
from .orders import Spectrum
from .twist_scatter import TwistScatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..drawing.drive import Drive
    from .individual_drive import Individual

TURNS = "turns of the crank"
SOURCES = {
    "passing": (PURPLE, "passing of the balls"),
    "lobes": (BLUE, "lobes alone"),
    "elements": (ORANGE, "balls and bores alone"),
    "rows": (GREEN, "rows of the cage"),
    "both": (FAINT, "lobes and balls together"),
}
"""Colour and label of every `Spectrum.source`."""


def ripple_map(turning: TurningMap, ax: Axes | None = None) -> Axes:
    """Torque minus its mean over the angles, in colour, over the rotation (x) and the twist (y)."""
    ax = new_axes(width=7.6) if ax is None else ax
    ripple = (turning.torque - turning.torque.mean(axis=0)).T
    most = float(np.quantile(np.abs(ripple), 0.999))
    picture = ax.pcolormesh(
        turning.crank_turns,
        turning.twist / ARCMIN,
        ripple,
        cmap="RdBu_r",
        vmin=-most,
        vmax=most,
        shading="nearest",
        rasterized=True,
    )
    format_axes(ax, TURNS, "twist at the output [arcmin]")
    ax.grid(False)
    figure = ax.get_figure()
    assert figure is not None
    bar = figure.colorbar(picture, ax=ax, pad=0.02)
    bar.set_label("torque minus its mean\nover the turn [N.m]", color=INK)
    bar.outline.set_edgecolor(FAINT)  # type: ignore[operator]
    return ax


def play_over_turn(free: NoLoad, ax: Axes | None = None) -> Axes:
    """The play without load over one turn of the output: the twists between which no element is pressed.

    Within one passing of an element only the means of both ends are drawn.
    """
    ax = new_axes(width=7.6) if ax is None else ax
    turns = _crank_turns(free.individual.drive, free.output_angle)
    low, high = (_per_pass(part, len(turns))[1] / ARCMIN for part in (free.forward, free.backward))
    ax.fill_between(turns, low, high, color=tint(INK, 0.4), linewidth=0, label="play, no load")
    format_axes(ax, TURNS, "twist without load [arcmin]")
    ax.set_xlim(0, free.individual.drive.transmission_ratio)
    return legend_above(ax)


def transmission_error_over_turn(loaded: LoadedTurn, ax: Axes | None = None) -> Axes:
    """Transmission error over one turn of the output: the twist under a torque minus the mean wind-up.

    Within one passing of an element only mean and range are drawn.
    """
    ax = new_axes(width=7.6) if ax is None else ax
    drive = loaded.individual.drive
    turns = _crank_turns(drive, loaded.output_angle)
    error = loaded.transmission_error - loaded.transmission_error.mean()
    least, middle, most = _per_pass(error, len(turns)) / ARCMIN
    name = f"{loaded.torque:.3g} N.m, without the mean wind-up"
    ax.fill_between(turns, least, most, color=tint(BLUE, 0.35), linewidth=0, label="range within a ball's passing")
    ax.plot(turns, middle, color=BLUE, linewidth=0.9, label=name)
    format_axes(ax, TURNS, "transmission error [arcmin]")
    ax.set_xlim(0, drive.transmission_ratio)
    return legend_above(ax)


def individual_text(individual: Individual) -> str:
    """An individual in the titles of its pictures."""
    which = "without deviations" if individual.seed is None else f"individual {individual.seed}"
    return f"{drive_name(individual.drive.name)}, {which}"


def order_spectrum(
    spectrum: Spectrum, quantity: str = "transmission error [arcmin]", named: int = 6, ax: Axes | None = None
) -> Axes:
    """Amplitudes over the order per turn of the crank, on logarithmic axes; the `named` largest are labelled."""
    ax = new_axes(width=7.6) if ax is None else ax
    amplitude, order = spectrum.amplitude[1:], spectrum.crank_order[1:]
    floor = float(amplitude.max()) / 1000 if amplitude.max() > 0 else 1.0
    shown = np.flatnonzero(amplitude >= floor)
    names = np.array([spectrum.source(int(k) + 1) for k in shown])
    for source, (colour, text) in SOURCES.items():
        some = shown[names == source]
        if some.size == 0:
            continue
        thick, front = (0.8, 1) if source == "both" else (1.6, 2)
        ax.vlines(order[some], floor, amplitude[some], color=colour, linewidth=thick, zorder=front)
        ax.plot(order[some], amplitude[some], "o", color=colour, markersize=2.5 * thick, label=text, zorder=front)
    format_axes(ax, "order per turn of the crank", quantity)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylim(floor, 2.5 * float(amplitude.max()))
    ax.xaxis.set_major_formatter("{x:g}")
    taken: list[float] = []
    for k in spectrum.strongest(3 * named):
        # Labels need room: orders close to a labelled one have none.
        free = all(abs(np.log(spectrum.crank_order[k] / other)) > 0.25 for other in taken)
        if free and spectrum.amplitude[k] >= floor and len(taken) < named:
            taken.append(float(spectrum.crank_order[k]))
            ax.annotate(
                f"{spectrum.crank_order[k]:.4g}",
                (spectrum.crank_order[k], spectrum.amplitude[k]),
                xytext=(0, 4),
                textcoords="offset points",
                ha="center",
                fontsize="x-small",
                color=INK,
            )
    legend_above(ax)
    return ax


def twists_of_individuals(individuals: TwistScatter, ax: Axes | None = None) -> Axes:
    """Twist of individuals minus the mean drive's over the torque; the first in bold, with its range over a turn."""
    ax = new_axes(width=7.6) if ax is None else ax
    torque = individuals.torque
    ax.fill_between(torque, individuals.low[0] / ARCMIN, individuals.high[0] / ARCMIN, color=tint(BLUE), linewidth=0)
    for k, middle in enumerate(individuals.mean[1:]):
        ax.plot(torque, middle / ARCMIN, color=FAINT, linewidth=1.0, label=None if k else "others of the drawing")
    ax.plot(
        torque,
        individuals.mean[0] / ARCMIN,
        color=BLUE,
        linewidth=2.0,
        label=f"individual {individuals.seeds[0]}, mean of its turn",
    )
    ax.axhline(0, color=INK, linewidth=0.8, label="mean drive")
    format_axes(ax, "torque at the output [N.m]", "twist minus the mean drive's [arcmin]")
    name = drive_name(individuals.drive.name)
    return legend_above(ax, f"{name}; shaded: range of individual {individuals.seeds[0]} over a turn of the output")


def _crank_turns(drive: Drive, output_angle: np.ndarray) -> np.ndarray:
    """Turns of the crank at the middle of every passing of an element."""
    return drive.transmission_ratio * _per_pass(output_angle, drive.lobes * drive.elements)[1] / (2 * np.pi)


def _per_pass(values: np.ndarray, passes: int) -> np.ndarray:
    """Minimum, mean and maximum within every passing, (3, passes)."""
    rows = values.reshape(passes, -1)
    return np.stack([rows.min(axis=1), rows.mean(axis=1), rows.max(axis=1)])


__all__ = [
    "individual_text",
    "order_spectrum",
    "play_over_turn",
    "ripple_map",
    "transmission_error_over_turn",
    "twists_of_individuals",
]
