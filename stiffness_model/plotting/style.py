"""Common style of the pictures: palette, axes, and legends that do not cover data.

Most colours are from Okabe and Ito's palette, which all types of colour vision distinguish; the purple is darker than
theirs. Lightness and dashes distinguish lines in greyscale print.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .text_fit import fit_text, legend_columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

Y_AXIS = 0.75
"""Inches that ticks and label of a y axis take; measured on the pictures of the presets."""
INK, FAINT, METAL = "#222222", "#9a9a9a", "#d9dce0"
BLUE, ORANGE, PURPLE, GREEN, RED, SKY = "#0072B2", "#E69F00", "#7B2D8B", "#009E73", "#D55E00", "#56B4E9"

DOTS_PER_INCH = 150
EDGE = 0.07
"""Inches that stay free around every axes and along the edges of a figure; chosen by judgement."""
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


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, sizes in inches, that arranges its axes and texts without overlap."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout=ConstrainedLayoutEngine(w_pad=EDGE, h_pad=EDGE))


def new_axes(width: float = 6.4, height: float = 4.2) -> Axes:
    """Empty axes in a new figure, sizes in inches; `axes.figure.savefig` saves it."""
    return new_figure(width, height).add_subplot()


def tint(colour: str, share: float = SHADE) -> str:
    """A colour mixed with white, opaque: where it covers another area, it does not mix with it.

    >>> tint("#0072B2", 0.5)
    '#80b8d8'
    """
    from matplotlib.colors import to_hex, to_rgb

    red, green, blue = (1 - share * (1 - part) for part in to_rgb(colour))
    return str(to_hex((red, green, blue)))


def drive_name(name: str) -> str:
    """A drive's name as it is written in a picture.

    >>> drive_name("drive_1"), drive_name("")
    ('drive 1', 'drive')
    """
    return name.replace("_", " ") or "drive"


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
    """The legend above the axes, away from the data, in rows of at most three; `title` explains the shaded areas."""
    room = _width(ax)
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(-0.01, 1.0),
        ncols=legend_columns(ax.get_legend_handles_labels()[1], room),
        frameon=False,
        handlelength=2.8,
        columnspacing=1.6,
        borderaxespad=0.2,
        labelcolor=INK,
        title=fit_text(title, room, "small") or None,
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
    """A small line above the axes, broken where it would be wider than they are."""
    ax.set_title(fit_text(text, _width(ax), "small"), loc="left", fontsize="small", color=INK)
    return ax


def headline(figure: Figure, text: str, size: str = "small") -> None:
    """A title over the whole figure, from its left edge, broken where it would be wider than the figure."""
    width = float(figure.get_size_inches()[0])
    figure.suptitle(fit_text(text, width - 2 * EDGE, size), x=EDGE / width, ha="left", fontsize=size, color=INK)


def _width(ax: Axes) -> float:
    """Width of axes in inches before the layout is known: their share of the figure, less room for the y axis."""
    figure, place = ax.get_figure(root=True), ax.get_subplotspec()
    assert figure is not None
    share = ax.get_position().width if place is None else len(place.colspan) / place.get_gridspec().ncols
    return share * float(figure.get_size_inches()[0]) - Y_AXIS


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
