"""Figures of a diagnosis."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN

from ...estimation.held_out import held_out_blocks
from ...estimation.least_squares import Fit
from ...estimation.problem import Problem
from ...estimation.residuals import predicted_scatter
from ...forward.parameter_layout import ZERO
from ...schema import Gap
from ..location import block_coordinates
from .svg_figure import svg

MEASURED, BEFORE, AFTER, NOISE, SCATTER = "#333333", "#c2452d", "#1f6fb2", "#bbbbbb", "#55a868"
"""Colours of measured values, of the model without and with effects, of the noise and of the tolerance scatter."""
MAX_POINTS = 1500
"""Points of a curve that are drawn at most, which bounds the size of the page; chosen by judgement."""
GAP = 5.0
"""Step between blocks, over the median step, from which a line is interrupted; chosen by judgement."""
MIN_SCATTER_SIZE = 0.1
"""Scatter size from which the residual is also drawn without the scatter; chosen by judgement."""


def curve_figure(problem: Problem, base: Fit, chosen: Fit) -> str:
    """Torque over twist in the run with the widest twist: measured, and the model without and with effects."""
    _, inside = widest_run(problem)
    x = _twist(problem, chosen)[inside]

    def draw(axes: Axes) -> None:
        axes.plot(x, problem.torque[inside], ".", ms=3, color=MEASURED, label="measured")
        joined = _with_gaps(problem, inside, x)
        axes.plot(joined, base.prediction.torque[inside], "-", lw=1.2, color=BEFORE, label=_base_label(problem))
        if chosen.names:
            axes.plot(joined, chosen.prediction.torque[inside], "-", lw=1.2, color=AFTER, label=_effects_label(chosen))
        _label(axes, "twist [arcmin]", "torque [N.m]")
        _legend(axes)

    return svg("torque over twist", draw)


def loop_figure(problem: Problem, base: Fit, chosen: Fit) -> str:
    """The same run less the model without effects, which shows loops that the whole curve conceals."""
    _, inside = widest_run(problem)
    x, zero = _twist(problem, chosen)[inside], base.prediction.torque[inside]

    def draw(axes: Axes) -> None:
        axes.axhspan(-2 * _noise(problem), 2 * _noise(problem), color=NOISE, alpha=0.5, lw=0, label="noise, 95 %")
        axes.axhline(0, lw=1.2, color=BEFORE, label=_base_label(problem))
        axes.plot(x, problem.torque[inside] - zero, ".", ms=3, color=MEASURED, label="measured")
        if chosen.names:
            axes.plot(
                _with_gaps(problem, inside, x),
                chosen.prediction.torque[inside] - zero,
                "-",
                lw=1.2,
                color=AFTER,
                label=_effects_label(chosen),
            )
        _label(axes, "twist [arcmin]", "torque - model without effects [N.m]")
        _legend(axes)

    return svg("residual of the model without effects over the twist", draw)


def widest_run(problem: Problem) -> tuple[int, NDArray[np.intp]]:
    """The run with the widest twist: its number and its blocks, the first `MAX_POINTS` of them."""
    runs = problem.trace.run[problem.blocks.first]
    twist = problem.blocks.mean(problem.trace.twist)
    widest = max(np.unique(runs), key=lambda r: float(np.ptp(twist[runs == r])))
    return int(widest), np.flatnonzero(runs == widest)[:MAX_POINTS]


def _with_gaps(problem: Problem, inside: NDArray[np.intp], x: Array) -> Array:
    """x (n,) of a line, NaN at the first block after a gap in time, across which a line would join what is apart."""
    step = np.diff(problem.blocks.mean(problem.trace.time)[inside], prepend=np.nan)
    return np.where(step > GAP * np.nanmedian(step), np.nan, x) if len(step) > 1 else x


def _twist(problem: Problem, chosen: Fit) -> Array:
    return (problem.blocks.mean(problem.trace.twist) - chosen.parameters[ZERO]) / ARCMIN


def _noise(problem: Problem) -> float:
    return float(np.sqrt(np.mean(problem.block_variance)))


def _base_label(problem: Problem) -> str:
    return "model as drawn" if problem.base.drive is not None else f"{problem.base.kind} alone"


def _effects_label(chosen: Fit) -> str:
    return "with the effect" if len(chosen.names) == 1 else "with the effects"


def _legend(axes: Axes) -> None:
    """A legend above the axes, where it covers no data."""
    axes.legend(
        fontsize=9,
        frameon=False,
        ncols=4,
        loc="lower left",
        bbox_to_anchor=(0, 1),
        columnspacing=1.0,
        handlelength=1.4,
        borderaxespad=0.2,
    )


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)


def residual_figure(problem: Problem, base: Fit, chosen: Fit, coordinate: str) -> str:
    """Residual without and with effects over a coordinate, beside the noise."""
    places = block_coordinates(problem)
    crank = np.degrees(problem.blocks.mean(problem.trace.crank)) % 360
    x, unit = {"crank_angle": (crank, "deg"), "direction": (problem.torque, "N.m")}.get(
        coordinate, places.get(coordinate, (problem.torque, "N.m"))
    )
    before, after = problem.torque - base.prediction.torque, problem.torque - chosen.prediction.torque
    noise = np.sqrt(problem.block_variance)
    going = np.sign(problem.blocks.mean(problem.trace.twist_rate))
    step = max(1, len(x) // MAX_POINTS)

    def draw(axes: Axes) -> None:
        order = np.argsort(x)
        band = 2 * noise[order]
        axes.fill_between(x[order], -band, band, color=NOISE, alpha=0.5, lw=0, label="noise, 95 %")
        if coordinate == "direction":
            for sign, mark in ((1, "^"), (-1, "v")):
                some = np.flatnonzero(going == sign)[::step]
                axes.plot(
                    x[some],
                    before[some],
                    mark,
                    ms=2.5,
                    color=BEFORE,
                    label=f"before, twist {'growing' if sign > 0 else 'falling'}",
                )
        else:
            axes.plot(x[::step], before[::step], ".", ms=2.5, color=BEFORE, label="before")
        if chosen.names:
            axes.plot(x[::step], after[::step], ".", ms=2.5, color=AFTER, label="after")
        name = "torque" if coordinate == "direction" else coordinate.replace("_", " ")
        _label(axes, f"{name} [{unit}]", "measured - model [N.m]")
        _legend(axes)

    return svg("residual over the coordinate in which the gap lies", draw)


def time_figure(problem: Problem, base: Fit, chosen: Fit) -> str:
    """Residual by blocks in the order of the record; blocks that were held out are shaded."""
    before, after = problem.torque - base.prediction.torque, problem.torque - chosen.prediction.torque
    held = held_out_blocks(problem)

    def draw(axes: Axes) -> None:
        k = np.arange(len(before))
        axes.plot(k, before, lw=0.6, color=BEFORE, label="before")
        if chosen.names:
            axes.plot(k, after, lw=0.6, color=AFTER, label="after")
            if len(chosen.weighting.eigenvalues) and chosen.weighting.size > MIN_SCATTER_SIZE:
                axes.plot(
                    k,
                    after - predicted_scatter(problem, chosen, after),
                    lw=0.5,
                    color=SCATTER,
                    label="after, without this drive's scatter",
                )
        low, high = axes.get_ylim()
        if chosen.names:
            axes.fill_between(k, low, high, where=held.tolist(), color=NOISE, alpha=0.35, lw=0, label="held out")
        axes.set_ylim(low, high)
        _label(axes, "block of samples, run after run", "measured - model [N.m]")
        _legend(axes)
        axes.margins(x=0.01)

    return svg("residual over the record", draw, 12.6, 3.2)


def gap_figure(gap: Gap, named: bool) -> str:
    """Bars of the gap without and with effects, beside the noise; named: whether effects are named."""
    rows = [("before" if named else "gap", gap.before, BEFORE)]
    if named:
        rows.append(("after", gap.after, AFTER))
    if gap.after_own_scatter is not None and gap.after_own_scatter < 0.9 * gap.after:
        rows.append(("without this\ndrive's scatter", gap.after_own_scatter, SCATTER))
    if named and gap.held_out_before is not None and gap.held_out_after is not None:
        rows += [("held out, before", gap.held_out_before, BEFORE), ("held out, after", gap.held_out_after, AFTER)]

    def draw(axes: Axes) -> None:
        axes.barh([r[0] for r in rows], [r[1] for r in rows], color=[r[2] for r in rows], height=0.6)
        axes.axvline(gap.noise, color=MEASURED, lw=1, ls="--")
        axes.text(gap.noise, -0.6, f" noise {gap.noise:.3g}", fontsize=9, ha="left", va="center")
        for k, row in enumerate(rows):
            axes.text(row[1], k, f" {row[1]:.3g}", va="center", fontsize=9)
        axes.set_ylim(max(len(rows), 4) - 0.4, -0.9)
        axes.grid(False, axis="y")
        _label(axes, "gap, rms [N.m]", "")
        axes.set_xlim(0, 1.15 * max(gap.noise, *(r[1] for r in rows)))

    return svg("the gap before and after, beside the noise", draw)
