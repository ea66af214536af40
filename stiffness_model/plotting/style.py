"""Common style of the pictures: palette, axes, and legends that do not cover data.

Most colours are from Okabe and Ito's palette, which all types of colour vision distinguish; the purple is darker than
theirs. Lightness and dashes distinguish lines in greyscale print.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

INK, FAINT, METAL = "#222222", "#9a9a9a", "#d9dce0"
BLUE, ORANGE, PURPLE, GREEN, RED, SKY = "#0072B2", "#E69F00", "#7B2D8B", "#009E73", "#D55E00", "#56B4E9"

SHADE = 0.16
"""Opacity of bands; low enough that two overlapping ones remain visible."""


@dataclass(frozen=True)
class Line:
    """Colour and dashes of one curve."""

    colour: str
    dashes: tuple[float, ...] = ()

    @property
    def style(self) -> str | tuple[int, tuple[float, ...]]:
        """The value for matplotlib's `linestyle`."""
        return (0, self.dashes) if self.dashes else "solid"


DRIVES = (Line(BLUE), Line(ORANGE, (6, 1.5)), Line(PURPLE, (6, 1.5, 1, 1.5)), Line(SKY, (3, 1.5)), Line(INK, (1, 1.2)))
"""Lines of drives in their order; the first three have the paper's colours."""
CONTACTS = (Line(BLUE), Line(RED, (6, 1.5)), Line(GREEN, (6, 1.5, 1, 1.5)), Line(INK, (1, 1.2)))
"""Gear, crank, cage t+, cage t-."""
GEARS = {"strain wave": GREEN, "cycloidal": RED}
"""Colours of published gears by kind."""
GEAR_DASHES = ((6.0, 1.5), (6.0, 1.5, 1.0, 1.5), (1.0, 1.2), (3.0, 1.5))


def new_axes(width: float = 6.4, height: float = 4.2) -> Axes:
    """Empty axes in a new figure, sizes in inches; `axes.figure.savefig` saves it."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=150, layout="constrained").add_subplot()


def format_axes(ax: Axes, x_label: str, y_label: str) -> Axes:
    """Axis labels, a light grid, and no spines at the top and on the right."""
    ax.set_xlabel(x_label, color=INK)
    ax.set_ylabel(y_label, color=INK)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(FAINT)
    ax.tick_params(color=FAINT, labelcolor=INK, direction="out", length=3)
    ax.grid(True, color="#e6e6e6", linewidth=0.7)
    ax.set_axisbelow(True)
    return ax


def start_axes_at_zero(ax: Axes) -> Axes:
    """Start both axes at zero and extend them beyond the data; shared axes extend beyond the data of all."""
    # matplotlib stops autoscaling once a limit is set, so a second call on shared axes must widen them.
    right, top = 1.05 * float(ax.dataLim.xmax), 1.05 * float(ax.dataLim.ymax)
    ax.set_xlim(0, max(ax.get_xlim()[1], right if math.isfinite(right) else 0))
    ax.set_ylim(0, max(ax.get_ylim()[1], top if math.isfinite(top) else 0))
    return ax


def legend_above(ax: Axes, title: str = "") -> Axes:
    """The legend in rows of three above the axes, away from the data; `title` explains the shaded areas."""
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(-0.01, 1.0),
        ncols=3,
        frameon=False,
        handlelength=2.8,
        columnspacing=1.6,
        borderaxespad=0.2,
        labelcolor=INK,
        title=title or None,
        alignment="left",
        title_fontproperties={"size": "small"},
    )
    return ax


def legend_beside(ax: Axes) -> Axes:
    """The legend to the right of the axes, its entries in the vertical order of the curves' ends."""
    drawn, names = ax.get_legend_handles_labels()
    last = [float(line.get_ydata()[-1]) for line in drawn]  # type: ignore[attr-defined]
    order = sorted(range(len(drawn)), key=lambda k: -last[k])
    ax.legend(
        [drawn[k] for k in order],
        [names[k] for k in order],
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        frameon=False,
        handlelength=2.8,
        labelspacing=0.9,
        borderaxespad=0.2,
        labelcolor=INK,
    )
    return ax


def caption(ax: Axes, text: str) -> Axes:
    """A small line above the axes."""
    ax.set_title(text, loc="left", fontsize="small", color=INK)
    return ax


def label_ends(ax: Axes, ends: Sequence[tuple[float, float, str, str]]) -> list[Text]:
    """Labels (x, y, text, colour) to the right of the ends of curves, shifted so that none overlap.

    Call it after the axes have their final limits.
    """
    # Height of a line of text in data units, estimated from the axes' height.
    figure = ax.get_figure(root=True)
    assert figure is not None
    height_in = ax.get_position().height * figure.get_size_inches()[1]
    low, high = ax.get_ylim()
    gap = (high - low) * 0.165 / height_in
    texts, previous = [], -float("inf")
    for x, y, text, colour in sorted(ends, key=lambda end: end[1]):
        previous = max(y, previous + gap)
        texts.append(
            ax.annotate(
                text,
                (x, previous),
                xytext=(5, 0),
                textcoords="offset points",
                va="center",
                ha="left",
                color=colour,
                fontsize="small",
                annotation_clip=False,
            )
        )
    return texts
