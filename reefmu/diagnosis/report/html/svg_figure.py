"""A figure as an <svg> element, drawn without pyplot, which would look for a window system.

The element states its axes and layers in the attribute data-figure, from which the page's script shows values under the
pointer and hides layers.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from html import escape
from typing import Any

from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.container import Container
from matplotlib.figure import Figure

POINTS_PER_INCH = 72.0
"""Units of the SVG per inch, as matplotlib writes it."""
_DIGITS = re.compile(r"(\d\.\d\d)\d+")
_COORDINATES = re.compile(r"\b(?:d|x|y)=\"[^\"]*\"")


def svg(name: str, draw: Callable[[Axes], None], width: float = 6.2, height: float = 3.5) -> str:
    """One figure as an <svg> element; name: what it shows, for screen readers; width, height: inches."""
    # Ids are hashed from the name, so that figures of a page share none and the same diagnosis gives the same page.
    with rc_context({"svg.hashsalt": name}):
        figure = Figure(figsize=(width, height), layout="constrained")
        axes = figure.add_subplot()
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        axes.tick_params(labelsize=9)
        axes.grid(True, color="#ececec", lw=0.7)
        axes.set_axisbelow(True)
        draw(axes)
        layers = _name_layers(axes, re.sub(r"\W+", "-", name))
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    # A hundredth of a point is finer than any screen; six digits would double the size of the page.
    text = _COORDINATES.sub(lambda found: _DIGITS.sub(r"\1", found[0]), text)
    about = escape(json.dumps({"axes": _scales(axes, width, height), "layers": layers}), quote=True)
    # HTML takes only the element, without the XML declaration.
    head = f'<svg role="img" aria-label="{name}" data-figure="{about}" '
    return re.sub(r"^.*?(?=<svg )<svg ", lambda _: head, text, flags=re.DOTALL)


def _name_layers(axes: Axes, name: str) -> dict[str, str]:
    """Ids of the artists in the legend, unique in a page, with their labels."""
    layers: dict[str, str] = {}
    for k, (handle, label) in enumerate(zip(*axes.get_legend_handles_labels(), strict=True)):
        if isinstance(handle, Artist) and not isinstance(handle, Container):
            handle.set_gid(f"{name}-{k}")
            layers[f"{name}-{k}"] = str(label)
    return layers


def _scales(axes: Axes, width: float, height: float) -> dict[str, Any] | None:
    """Edges of the axes in units of the SVG and their values, linear in between; None for other scales or names."""
    if axes.get_xscale() != "linear" or axes.get_yscale() != "linear" or not axes.get_ylabel():
        return None
    box = axes.get_position()
    return {
        "x": [POINTS_PER_INCH * width * box.x0, POINTS_PER_INCH * width * box.x1, *axes.get_xlim()],
        "y": [POINTS_PER_INCH * height * (1 - box.y0), POINTS_PER_INCH * height * (1 - box.y1), *axes.get_ylim()],
        "xlabel": axes.get_xlabel(),
        "ylabel": axes.get_ylabel(),
    }
