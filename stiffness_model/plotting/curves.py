"""Figures of the paper and further ones of results. Every function draws on `ax`, or on new axes, and returns them.

Angles in arcmin at the output, torques in N.m. Bands are the 10th and 90th percentile over the drives. matplotlib is
imported when a picture is drawn.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..catalog.gears import CatalogGear
from ..errors import expect
from ..montecarlo.population import Population
from ..montecarlo.twist_torque_curve import BAND, TwistTorqueCurve
from ..montecarlo.virtual_drives import LOW_TORQUE_SHARE
from ..numerics.arrays import Array
from ..units import ARCMIN
from .profile import gear_profile
from .style import (
    CONTACTS,
    DRIVES,
    GEAR_DASHES,
    GEARS,
    INK,
    SHADE,
    Line,
    caption,
    drive_name,
    format_axes,
    label_ends,
    legend_above,
    legend_beside,
    new_axes,
    start_axes_at_zero,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


__all__ = [
    "against_catalog",
    "contact_forces",
    "gear_profile",
    "load_share",
    "save",
    "stiffness_over_torque",
    "twist_over_torque",
    "twist_over_torque_band",
]

TORQUE, TWIST = "torque at the output [N.m]", "twist at the output [arcmin]"
BAND_TEXT = "shaded: 10th to 90th percentile of the drives"
WHISKER_TEXT = "bars: 10th to 90th percentile of the drives"
WHISKERS = 8
"""Bars per curve where the bands of several would cover each other; chosen by judgement."""


def twist_over_torque(curves: TwistTorqueCurve | Sequence[TwistTorqueCurve], ax: Axes | None = None) -> Axes:
    """Twist over torque of one or several drives, mean and band (figure 7 of the paper)."""
    ax = new_axes() if ax is None else ax
    several = _list(curves)
    for curve, line in zip(several, _lines(len(several)), strict=True):
        _curve(ax, curve, line)
    format_axes(ax, TORQUE, TWIST)
    _start_at_zero(ax, several)
    return legend_above(ax, BAND_TEXT if any(map(_has_band, several)) else "")


def twist_over_torque_band(
    twist: Array, torque: Array, low: Array, high: Array, name: str = "", ax: Axes | None = None
) -> Axes:
    """Twist, (n,) rad, over a mean torque and its band, (n,) N.m each."""
    ax = new_axes() if ax is None else ax
    _sideways_band(ax, twist, torque, low, high, DRIVES[0], drive_name(name))
    format_axes(ax, TORQUE, TWIST)
    return legend_above(ax, BAND_TEXT)


def against_catalog(curve: TwistTorqueCurve, gears: Iterable[CatalogGear], ax: Axes | None = None) -> Axes:
    """Twist over torque of a drive beside published gears (figure 8 of the paper).

    Gears are drawn up to the drive's torque or to the greatest torque in their catalogue row; rows without a curve are
    omitted. The published curves do not include lost motion.
    """
    ax = new_axes(width=7.6) if ax is None else ax
    _curve(ax, curve, DRIVES[0])
    full = curve.full_torque
    for k, gear in enumerate(gear for gear in gears if gear.has_curve):
        torque = np.linspace(0.0, min(full, gear.greatest_torque or full), 201)
        # Include the breakpoints of the piecewise linear curve.
        breakpoints = [bend for bend in (gear.t1, gear.t2) if bend is not None and bend < torque[-1]]
        torque = np.unique(np.concatenate([torque, breakpoints]))
        ax.plot(
            torque,
            gear.twist_at(torque) / ARCMIN,
            color=GEARS.get(gear.kind, INK),
            linewidth=1.6,
            linestyle=(0, GEAR_DASHES[k % len(GEAR_DASHES)]),
            label=_two_lines(gear),
        )
    format_axes(ax, TORQUE, TWIST)
    _start_at_zero(ax, [curve])
    published = "published gears: without lost motion"
    return caption(legend_beside(ax), f"{BAND_TEXT}; {published}" if _has_band(curve) else published)


def stiffness_over_torque(curves: TwistTorqueCurve | Sequence[TwistTorqueCurve], ax: Axes | None = None) -> Axes:
    """Stiffness of the mean curve over its torque, one or several drives."""
    ax = new_axes() if ax is None else ax
    several = _list(curves)
    for curve, line in zip(several, _lines(len(several)), strict=True):
        ax.plot(
            curve.torque,
            curve.stiffness * ARCMIN,
            color=line.colour,
            linestyle=line.style,
            linewidth=1.8,
            label=drive_name(curve.name),
        )
    format_axes(ax, TORQUE, "stiffness [N.m/arcmin]")
    _start_at_zero(ax, several)
    return legend_above(ax)


def contact_forces(population: Population, ax: Axes | None = None) -> Axes:
    """Greatest force at each contact over the drive's mean torque, mean and band (figure 9 of the paper).

    The forces of the contacts scatter over the same range, so their bands are bars beside each other.
    """
    ax = new_axes() if ax is None else ax
    order, torque = _by_torque(population)
    force = population.contact_force[:, order]
    low, high = np.percentile(force, BAND, axis=0)
    mean = force.mean(axis=0)
    contacts = list(enumerate(zip(CONTACTS, population.contact_names, strict=True)))
    for k, (line, name) in contacts:
        ax.plot(torque, mean[:, k], color=line.colour, linestyle=line.style, linewidth=1.8, label=name)
        _whiskers(ax, torque, low[:, k], high[:, k], line, (k + 0.5) / len(contacts))
    format_axes(ax, TORQUE, "greatest contact force [N]")
    start_axes_at_zero(ax)
    if torque[-1] > 0:
        # The labels are at the ends of the curves.
        ax.set_xlim(0, torque[-1])
    caption(ax, f"{drive_name(population.drive.name)}; {WHISKER_TEXT}")
    label_ends(ax, [(torque[-1], mean[-1, k], name, line.colour) for k, (line, name) in contacts])
    return ax


def load_share(populations: Population | Sequence[Population], ax: Axes | None = None) -> Axes:
    """Greatest share of one element in the torque over the drive's mean torque (figure 10 of the paper).

    The low torque region, below `LOW_TORQUE_SHARE` of the greatest mean torque, is excluded, and so are twists at which
    some drives carry no torque that could be shared.
    """
    ax = new_axes() if ax is None else ax
    several = list(populations) if isinstance(populations, Sequence) else [populations]
    expect(len(several) > 0, "at least one population", populations, "populations")
    all_carried = True
    for population, line in zip(several, _lines(len(several)), strict=True):
        order, torque = _by_torque(population)
        kept = population.representative[order] & (torque > 0)
        carried = np.asarray(np.isfinite(population.load_share[:, order]).all(axis=0))
        all_carried = all_carried and bool(carried[kept].all())
        order, torque = order[kept & carried], torque[kept & carried]
        share = 100 * population.load_share[:, order]
        low, high = np.percentile(share, BAND, axis=0)
        _band(ax, torque, share.mean(axis=0), low, high, line, drive_name(population.drive.name))
    format_axes(ax, TORQUE, "greatest load share of an element [%]")
    start_axes_at_zero(ax)
    low = f"torques below {100 * LOW_TORQUE_SHARE:g} % of the greatest"
    left_out = f" {low}" if all_carried else f"\n{low}, or that some drives do not carry,"
    return legend_above(ax, f"{BAND_TEXT};{left_out} left out")


def save(ax: Axes, path: str | os.PathLike[str]) -> None:
    """Write the figure of `ax` in the format of the path's suffix."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.savefig(path)


def _curve(ax: Axes, curve: TwistTorqueCurve, line: Line) -> None:
    _sideways_band(ax, curve.twist, curve.torque, curve.torque_p10, curve.torque_p90, line, drive_name(curve.name))


def _sideways_band(ax: Axes, twist: Array, torque: Array, low: Array, high: Array, line: Line, name: str) -> None:
    """Mean and band of the torque, along x, at each twist."""
    angle = twist / ARCMIN
    ax.fill_betweenx(angle, low, high, color=line.colour, alpha=SHADE, linewidth=0)
    for edge in (low, high):
        ax.plot(edge, angle, color=line.colour, linewidth=0.6)
    ax.plot(torque, angle, color=line.colour, linestyle=line.style, linewidth=1.8, label=name)


def _band(ax: Axes, x: Array, mean: Array, low: Array, high: Array, line: Line, name: str) -> None:
    ax.fill_between(x, low, high, color=line.colour, alpha=SHADE, linewidth=0)
    for edge in (low, high):
        ax.plot(x, edge, color=line.colour, linewidth=0.6)
    ax.plot(x, mean, color=line.colour, linestyle=line.style, linewidth=1.8, label=name)


def _whiskers(ax: Axes, x: Array, low: Array, high: Array, line: Line, place: float) -> None:
    """The band as `WHISKERS` bars with caps. place: of each bar in its part of the range of x, 0 to 1."""
    at = x[0] + (x[-1] - x[0]) * (np.arange(WHISKERS) + place) / WHISKERS
    ends = [np.interp(at, x, edge) for edge in (low, high)]
    ax.vlines(at, *ends, color=line.colour, linewidth=1.2)
    for end in ends:
        ax.plot(at, end, color=line.colour, linestyle="", marker="_", markersize=6)
    # The axes also hold the band between the last bar and the end of the curve.
    ax.update_datalim(np.column_stack([x, high]))
    ax.autoscale_view()


def _by_torque(population: Population) -> tuple[NDArray[np.intp], Array]:
    """Order of the twists and the mean torque at them."""
    order = np.argsort(population.twist)
    return order, population.torque[:, order].mean(axis=0)


def _list(curves: TwistTorqueCurve | Sequence[TwistTorqueCurve]) -> list[TwistTorqueCurve]:
    several = [curves] if isinstance(curves, TwistTorqueCurve) else list(curves)
    expect(len(several) > 0, "at least one curve", curves, "curves")
    return several


def _has_band(curve: TwistTorqueCurve) -> bool:
    """Whether the drives of a curve differ; those of a data sheet do not."""
    return bool((curve.torque_p90 > curve.torque_p10).any())


def _lines(count: int) -> list[Line]:
    return [DRIVES[k % len(DRIVES)] for k in range(count)]


def _two_lines(gear: CatalogGear) -> str:
    """A gear's label with a line break after the maker."""
    return gear.label.replace(f"{gear.maker} ", f"{gear.maker}\n", 1)


def _start_at_zero(ax: Axes, curves: Iterable[TwistTorqueCurve]) -> None:
    """Start both axes at zero, unless a curve covers both signs."""
    if all(curve.twist[0] >= 0 for curve in curves):
        start_axes_at_zero(ax)
