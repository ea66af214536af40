"""Pictures of a diagnosis as inline SVG: drawn without pyplot, so that no window system is asked."""

from __future__ import annotations

import io
import re
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stiffness_model.units import ARCMIN

from .fit import Fit
from .locate import coordinates
from .remainder import scattered
from .report_gap import held_out
from .study import Study

Array = NDArray[np.float64]

MEASURED, BEFORE, AFTER, NOISE = "#333333", "#c2452d", "#1f6fb2", "#bbbbbb"
MOST_POINTS = 1500


def svg(draw: Callable[[Axes], None], width: float = 6.2, height: float = 3.4) -> str:
    """One picture as an <svg> element."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.add_subplot()
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8)
    draw(axes)
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    # Only the element itself: an XML head has no place in HTML.
    return re.sub(r"^.*?(?=<svg )", "", text, flags=re.DOTALL)


def curve_picture(study: Study, base: Fit, chosen: Fit) -> str:
    """Torque over twist: measured, model before and after, in the run with the widest loop."""
    runs = study.trace.run[study.blocks.first]
    twist = study.blocks.mean(study.trace.twist) - chosen.parameters[0]
    widest = max(np.unique(runs), key=lambda r: float(np.ptp(twist[runs == r])))
    inside = np.flatnonzero(runs == widest)[:MOST_POINTS]

    def draw(axes: Axes) -> None:
        x = twist[inside] / ARCMIN
        axes.plot(x, study.torque[inside], ".", ms=2.5, color=MEASURED, label="measured")
        axes.plot(x, base.prediction.torque[inside], "-", lw=1, color=BEFORE, label="model as drawn")
        if chosen.names:
            axes.plot(x, chosen.prediction.torque[inside], "-", lw=1, color=AFTER, label="with the effect")
        axes.set_xlabel("twist [arcmin]", fontsize=8)
        axes.set_ylabel("torque [N.m]", fontsize=8)
        axes.legend(fontsize=8, frameon=False)
        axes.set_title(f"run {widest}", fontsize=9, loc="left")

    return svg(draw)


def residual_picture(study: Study, base: Fit, chosen: Fit, coordinate: str) -> str:
    """Residual before and after over the coordinate where the gap lives, against the noise."""
    places = coordinates(study)
    crank = np.degrees(study.blocks.mean(study.trace.crank)) % 360
    x, unit = {"crank_angle": (crank, "deg"), "direction": (study.torque, "N.m")}.get(
        coordinate, places.get(coordinate, (study.torque, "N.m")))
    before, after = study.torque - base.prediction.torque, study.torque - chosen.prediction.torque
    noise = np.sqrt(study.block_variance)
    going = np.sign(study.blocks.mean(study.trace.twist_rate))
    step = max(1, len(x) // MOST_POINTS)

    def draw(axes: Axes) -> None:
        order = np.argsort(x)
        band = 2 * noise[order]
        axes.fill_between(x[order], -band, band, color=NOISE, alpha=0.5, lw=0, label="noise, 95 %")
        if coordinate == "direction":
            for sign, mark in ((1, "^"), (-1, "v")):
                some = np.flatnonzero(going == sign)[::step]
                axes.plot(x[some], before[some], mark, ms=2.5, color=BEFORE,
                          label=f"before, twist {'growing' if sign > 0 else 'falling'}")
        else:
            axes.plot(x[::step], before[::step], ".", ms=2.5, color=BEFORE, label="before")
        if chosen.names:
            axes.plot(x[::step], after[::step], ".", ms=2.5, color=AFTER, label="after")
        name = "torque" if coordinate == "direction" else coordinate.replace("_", " ")
        axes.set_xlabel(f"{name} [{unit}]", fontsize=8)
        axes.set_ylabel("measured - model [N.m]", fontsize=8)
        axes.legend(fontsize=8, frameon=False, ncols=2)

    return svg(draw)


def time_picture(study: Study, base: Fit, chosen: Fit) -> str:
    """Residuals sample by sample; what was held out is shaded."""
    before, after = study.torque - base.prediction.torque, study.torque - chosen.prediction.torque
    held = held_out(study)

    def draw(axes: Axes) -> None:
        k = np.arange(len(before))
        axes.plot(k, before, lw=0.6, color=BEFORE, label="before")
        if chosen.names:
            axes.plot(k, after, lw=0.6, color=AFTER, label="after")
            if len(chosen.weighting.strength):
                axes.plot(k, after - scattered(study, chosen, after), lw=0.5, color="#55a868",
                          label="after, without this drive's scatter")
        low, high = axes.get_ylim()
        axes.fill_between(k, low, high, where=held.tolist(), color=NOISE, alpha=0.35, lw=0, label="held out")
        axes.set_ylim(low, high)
        axes.set_xlabel("sample block, run after run", fontsize=8)
        axes.set_ylabel("measured - model [N.m]", fontsize=8)
        axes.legend(fontsize=8, frameon=False, ncols=4)

    return svg(draw, 12.6, 3.0)


def gap_picture(before: float, after: float | None, noise: float, held: tuple[float, float] | None) -> str:
    """Bars of the gap before and after against the noise."""
    rows = [("before", before, BEFORE)]
    if after is not None:
        rows.append(("after", after, AFTER))
    if held is not None:
        rows += [("before, held out", held[0], BEFORE), ("after, held out", held[1], AFTER)]

    def draw(axes: Axes) -> None:
        axes.barh([r[0] for r in rows], [r[1] for r in rows], color=[r[2] for r in rows], height=0.6)
        axes.axvline(noise, color=MEASURED, lw=1, ls="--")
        axes.text(noise, -0.75, "noise", fontsize=8, ha="center")
        for k, row in enumerate(rows):
            axes.text(row[1], k, f" {row[1]:.3g}", va="center", fontsize=8)
        axes.invert_yaxis()
        axes.set_xlabel("gap, rms [N.m]", fontsize=8)
        axes.margins(x=0.15)

    return svg(draw, 6.2, 2.0)
