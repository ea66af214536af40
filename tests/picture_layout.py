"""Checks of a figure's layout: texts inside the figure, apart from each other, and clear of lines and legends.

    python -m tests.picture_layout PROGRAM.py [ARGUMENT ...]

runs a program and fails if a figure that it saves has faults.
"""

from __future__ import annotations

import runpy
import sys
from collections.abc import Callable
from itertools import combinations
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox

TOLERANCE = 1.5
"""Pixels by which boxes may overlap or leave the figure: extents are whole pixels."""


def layout_faults(figure: Figure, *, drawn: bool = False) -> list[str]:
    """What is wrong with the layout of a figure, one line each; empty where nothing is. drawn: it was drawn before.

    A text must lie inside the figure, must not overlap another text, and must not be crossed by a line or an outline
    that is drawn in the same axes, unless it has an opaque background. A legend must not cover a line of its axes.
    """
    if not drawn:
        FigureCanvasAgg(figure).draw()
    texts = [(text, Text.get_window_extent(text)) for text in _texts(figure)]
    faults = [f"{_name(text)} leaves the figure" for text, box in texts if not _inside(box, figure.bbox)]
    faults += [
        f"{_name(first)} and {_name(second)} overlap"
        for (first, a), (second, b) in combinations(texts, 2)
        if _overlap(a, b)
    ]
    for ax in figure.axes:
        outlines = _outlines(ax)
        for text in ax.texts:
            if text.get_text().strip() and text.get_visible() and not _opaque(text):
                box = Text.get_window_extent(text).padded(-TOLERANCE)
                faults += [f"{_name(text)} is crossed by {what}" for what, path in outlines if _crosses(path, box)]
        legend = ax.get_legend()
        if legend is not None:
            box = legend.get_window_extent().padded(-TOLERANCE)
            faults += [f"the legend covers {what}" for what, path in outlines if _crosses(path, box)]
    return sorted(set(faults))


def checked_savefig(found: list[str]) -> Callable[..., None]:
    """A replacement of `Figure.savefig` that appends the faults of every figure to `found`."""
    save = Figure.savefig

    def savefig(self: Figure, name: Any, *args: Any, **options: Any) -> None:
        save(self, name, *args, **options)
        file = FilePath(name).name if isinstance(name, str | FilePath) else "figure"
        # Only a PNG has been drawn with the pixels of the figure.
        found.extend(f"{file}: {fault}" for fault in layout_faults(self, drawn=file.endswith(".png")))

    return savefig


def _texts(figure: Figure) -> list[Text]:
    """The texts of a figure that are drawn; those of ticks outside of the limits are not."""
    hidden: set[Artist] = set()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            shown = [] if not (ax.axison and axis.get_visible()) else [t for t in ticks if _within_limits(axis, t)]
            for tick in ticks:
                if tick not in shown:
                    hidden |= {tick.label1, tick.label2}
            if not shown:
                hidden |= {axis.label, axis.get_offset_text()} if not ax.axison else set()
    return [
        text
        for text in figure.findobj(Text)
        if isinstance(text, Text) and text not in hidden and text.get_visible() and text.get_text().strip()
    ]


def _within_limits(axis: Axis, tick: Any) -> bool:
    low, high = sorted(axis.get_view_interval())
    return bool(low - 1e-9 * (high - low) <= tick.get_loc() <= high + 1e-9 * (high - low))


def _inside(box: Bbox, figure: Bbox) -> bool:
    whole = figure.padded(TOLERANCE)
    return bool(box.x0 >= whole.x0 and box.y0 >= whole.y0 and box.x1 <= whole.x1 and box.y1 <= whole.y1)


def _overlap(a: Bbox, b: Bbox) -> bool:
    across, up = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
    return bool(across > TOLERANCE and up > TOLERANCE)


def _opaque(text: Text) -> bool:
    patch = text.get_bbox_patch()
    return patch is not None and patch.get_facecolor()[3] == 1.0


def _outlines(ax: Axes) -> list[tuple[str, Path]]:
    """Lines and outlines of patches of the axes in pixels; of clipped ones the points inside the axes."""
    artists = [*ax.lines, *ax.patches, *(a for a in ax.artists if isinstance(a, Patch))]
    return [(_name(a), _clipped(a, ax.bbox)) for a in artists if a.get_visible() and _is_drawn(a)]


def _clipped(artist: Any, box: Bbox) -> Path:
    path: Path = artist.get_transform().transform_path(artist.get_path())
    if not artist.get_clip_on() or isinstance(artist, Patch):
        return path
    vertices = np.array(path.vertices)
    outside = (vertices < [box.x0, box.y0]).any(axis=1) | (vertices > [box.x1, box.y1]).any(axis=1)
    vertices[outside] = np.nan
    return Path(vertices, path.codes)


def _is_drawn(artist: Any) -> bool:
    if isinstance(artist, Line2D):
        return artist.get_linestyle() not in ("None", "none", "") and len(artist.get_xydata()) > 1
    return artist.get_linewidth() > 0 and artist.get_edgecolor()[3] > 0 and not isinstance(artist, FancyArrowPatch)


def _crosses(path: Path, box: Bbox) -> bool:
    if len(path.vertices) < 2 or box.width <= 0 or box.height <= 0:
        return False
    return bool(path.intersects_bbox(box, filled=False))


def _name(artist: Any) -> str:
    if isinstance(artist, Text):
        return repr(artist.get_text()[:60])
    return f"{type(artist).__name__} {artist.get_gid() or artist.get_label()}"


def main() -> None:
    """Run the program of the command line with every figure checked; exit status 1 with the faults."""
    found: list[str] = []
    Figure.savefig = checked_savefig(found)  # type: ignore[method-assign]
    sys.argv = sys.argv[1:]
    sys.path.insert(0, str(FilePath(sys.argv[0]).parent))
    runpy.run_path(sys.argv[0], run_name="__main__")
    if found:
        sys.exit("\n".join(found))


if __name__ == "__main__":
    main()
