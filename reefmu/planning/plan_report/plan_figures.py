"""Figures of a plan as inline SVG: the protocol over time, the isolability matrix, power over the size."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from stiffness_model.plotting.style import BLUE, FAINT, INK, ORANGE, PURPLE, RED
from stiffness_model.units import ARCMIN

from ...diagnosis.report.html.svg_figure import svg
from ..shortest_plan import Plan
from .result import limits

MATRIX_SIZE = 0.36
"""Height of a row of the matrix in inches; chosen by judgement for labels of nine points."""


def protocol_figure(plan: Plan) -> str:
    """Twist, crank and temperature over the duration of the protocol, in seconds where it is below a minute."""
    unit, second = ("min", 1 / 60) if plan.seconds >= 60 else ("s", 1.0)

    def draw(axes: Axes) -> None:
        top = max(float(np.abs(p.twist).max()) for p in plan.schedule.pieces) / ARCMIN
        for begin, piece in zip(plan.schedule.begin, plan.schedule.pieces, strict=True):
            time = second * (begin + np.cumsum(piece.step) - piece.step[0])
            turning = bool(np.ptp(piece.crank) > 0)
            colour = RED if piece.temperature > 25 else ORANGE if turning else BLUE
            axes.plot(time, piece.twist / ARCMIN, lw=0.9, color=colour)
            if turning:
                axes.axvspan(time[0], time[-1], color=ORANGE, alpha=0.12, lw=0)
            if piece.temperature > 25:
                axes.axvspan(time[0], time[-1], color=RED, alpha=0.10, lw=0)
        axes.set_ylim(-1.15 * max(top, 1e-9), 1.15 * max(top, 1e-9))
        axes.set_xlabel(f"time [{unit}]", fontsize=9)
        axes.set_ylabel("twist [arcmin]", fontsize=9)
        for colour, label in ((BLUE, "crank locked"), (ORANGE, "crank turning"), (RED, "warm")):
            axes.plot([], [], color=colour, lw=2, label=label)
        axes.legend(fontsize=9, frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2)
        axes.margins(x=0.01)

    return svg("set points of the protocol over time", draw, 12.6, 3.2)


def matrix_figure(plan: Plan) -> str:
    """Probability of each name (columns) while nothing or an effect is true (rows)."""
    found = plan.isolability
    rows = ["nothing missing", *found.true]
    columns = [*found.names, "none named"]

    def draw(axes: Axes) -> None:
        axes.imshow(found.matrix, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axes.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=45, ha="right")
        axes.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows])
        axes.grid(False)
        for i, row in enumerate(found.matrix):
            for j, p in enumerate(row):
                if p >= 0.005:
                    axes.text(
                        j, i, f"{100 * p:.0f}", ha="center", va="center", fontsize=8, color="white" if p > 0.6 else INK
                    )
        axes.set_xlabel("named [% of cases]", fontsize=9)
        axes.set_ylabel("true", fontsize=9)

    return svg("predicted isolability matrix", draw, 3.2 + 0.5 * len(columns), 1.9 + MATRIX_SIZE * len(rows))


def power_figure(plan: Plan) -> str:
    """Bars of the sizes from which each effect is detected and named, in typical sizes."""
    found = plan.isolability
    names = list(found.true)
    found_limits = limits(plan)
    detected = [limit.detected_from / limit.typical for limit in found_limits]
    named = [None if limit.named_from is None else limit.named_from / limit.typical for limit in found_limits]

    def draw(axes: Axes) -> None:
        y = np.arange(len(names))
        low, high = float(found.sizes[0]), float(found.sizes[-1])
        for k in range(len(names)):
            axes.plot([low, high], [k, k], color="#ececec", lw=0.8, zorder=0)
            axes.plot(np.clip(detected[k], low, high), k, "o", ms=6, mfc="none", color=PURPLE)
            limit = named[k]
            if limit is not None:
                axes.plot(limit, k, "o", ms=6, color=BLUE)
                axes.plot([np.clip(detected[k], low, high), limit], [k, k], color=FAINT, lw=1)
            else:
                axes.plot(high, k, "x", ms=7, color=RED)
        axes.axvline(1, color=INK, lw=1, ls="--")
        axes.set_xscale("log")
        axes.set_xlim(0.8 * low, 1.25 * high)
        axes.set_yticks(y, [n.replace("_", " ") for n in names])
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlabel("size over the typical size", fontsize=9)
        for mark, colour, label in (("o", PURPLE, "detected"), ("o", BLUE, "named"), ("x", RED, "not named")):
            fill = "none" if label == "detected" else colour
            axes.plot([], [], mark, color=colour, mfc=fill, label=label)
        axes.legend(fontsize=9, frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2)

    return svg("sizes from which effects are detected and named", draw, 6.2, 1.3 + 0.3 * len(names))
