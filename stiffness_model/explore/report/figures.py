"""Figures of a study: the Pareto front, objectives and parameters along it, and the main effects.

Every function returns the axes it drew on, or the list of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...numerics.arrays import Array
from ...plotting.style import BLUE, RED, SHADE, caption, format_axes, headline, legend_above, new_axes, new_figure
from ..definition.metrics import METRICS
from ..definition.study import torque_text
from .main_effects import parameter_effect, sampled_designs
from .results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes


COLOURS = "viridis"
LOG_AXIS_RATIO = 30.0
"""Ratio of the greatest to the least value from which an axis is logarithmic; chosen by judgement."""
MARGIN = 0.08
"""Margin of an axis beyond its values, as a share of their range."""


def pareto_front(results: Results, ax: Axes | None = None) -> Axes:
    """The first two objectives of all feasible designs and of the front; the third, if any, as the colour."""
    ax = new_axes(7.2, 5.0) if ax is None else ax
    names = list(results.study.objectives)
    x, y = results.display_values(names[0]), results.display_values(names[1])
    members = results.front
    others = np.setdiff1d(np.flatnonzero(results.feasible), members)
    ax.scatter(x[others], y[others], s=6, color="#cfcfcf", linewidth=0, label="feasible designs")
    if len(members):
        dots = ax.scatter(
            x[members],
            y[members],
            s=26,
            edgecolor="white",
            linewidth=0.4,
            zorder=3,
            label="Pareto front",
            **_colours(results),
        )
        if len(names) >= 3:
            figure = ax.get_figure(root=True)
            assert figure is not None
            figure.colorbar(dots, ax=ax, label=f"{METRICS[names[2]].label}, {_sense(results, names[2])}")
        _limits(ax, "x", x[members])
        _limits(ax, "y", y[members])
    _star(ax, x, y, results)
    format_axes(
        ax,
        f"{METRICS[names[0]].label}, {_sense(results, names[0])}",
        f"{METRICS[names[1]].label}, {_sense(results, names[1])}",
    )
    return legend_above(
        ax,
        f"{_title(results)}: {len(results.evaluations)} designs, {results.feasible.sum()} feasible, "
        f"{len(members)} on the front",
    )


def _colours(results: Results) -> dict[str, Any]:
    """Colours of the front's members: by the third objective, if there is one."""
    names = list(results.study.objectives)
    return (
        {"color": BLUE} if len(names) < 3 else {"c": results.display_values(names[2])[results.front], "cmap": COLOURS}
    )


def trade_off(results: Results) -> list[Axes]:
    """The trade-off along the front: the other objectives and all parameters over the first objective."""
    names, members = list(results.study.objectives), results.front
    rows = [*names[1:], *range(len(results.study.parameters))]
    columns = 2 if len(rows) > 3 else 1
    height = -(-len(rows) // columns)
    figure = new_figure(4.6 * columns + 0.8, 2.0 * height + 0.8)
    axes: list[Axes] = list(figure.subplots(height, columns, squeeze=False, sharex=True).ravel())
    x = results.display_values(names[0])
    dots = None
    for k, (ax, row) in enumerate(zip(axes, rows, strict=False)):
        y = results.display_values(row) if isinstance(row, str) else _shown_numbers(results, row)
        dots = ax.scatter(x[members], y[members], s=14, linewidth=0, **_colours(results))
        _star(ax, x, y, results)
        last = k + columns >= len(rows)
        format_axes(
            ax,
            METRICS[names[0]].label if last else "",
            METRICS[row].label if isinstance(row, str) else _parameter_label(results, row),
        )
        ax.xaxis.set_tick_params(labelbottom=last)
        if isinstance(row, str):
            _limits(ax, "y", y[members])
        else:
            _whole_range(ax, results, row)
            _ticks(ax, results, row, "y")
    if len(members):
        _limits(axes[0], "x", x[members])
    for ax in axes[len(rows) :]:
        ax.remove()
    if len(names) >= 3 and dots is not None and len(members):
        figure.colorbar(dots, ax=axes[: len(rows)], label=METRICS[names[2]].label, aspect=40)
    headline(figure, f"{_title(results)}: along the front; star: chosen")
    return axes[: len(rows)]


def main_effects(results: Results) -> list[Axes]:
    """Every objective over every parameter: mean and P10 to P90 of the simulated part of the sample."""
    names, parameters = list(results.study.objectives), results.study.parameters
    figure = new_figure(2.3 * len(parameters) + 0.8, 2.1 * len(names) + 0.7)
    grid = figure.subplots(len(names), len(parameters), squeeze=False, sharey="row")
    for i, name in enumerate(names):
        low, high = [], []
        for j in range(len(parameters)):
            ax, effect = grid[i, j], parameter_effect(results, j, name)
            x = effect.centre / parameters[j].scale
            ax.fill_between(x, effect.low, effect.high, color=BLUE, alpha=SHADE, linewidth=0)
            ax.plot(x, effect.mean, color=BLUE, linewidth=1.6, marker=".", markersize=4)
            below, beside = i == len(names) - 1, j == 0
            format_axes(ax, _parameter_label(results, j) if below else "", METRICS[name].label if beside else "")
            caption(ax, f"{100 * effect.index:.0f} %")
            _ticks(ax, results, j, "x")
            low.append(effect.low.min(initial=np.inf))
            high.append(effect.high.max(initial=-np.inf))
        _scale_axis(grid[i, 0], "y", np.array([min(low), max(high)]))
    headline(
        figure,
        f"{_title(results)}: mean and P10 to P90 of {len(sampled_designs(results))} sampled designs; above: share "
        "of the variance due to the parameter alone",
    )
    return list(grid.ravel())


def _title(results: Results) -> str:
    return f"{results.study.name.replace('_', ' ')}, at {torque_text(results.study.numbers.torque)}"


def _sense(results: Results, name: str) -> str:
    return "less is better" if results.study.objectives[name] == "min" else "more is better"


def _star(ax: Axes, x: Array, y: Array, results: Results) -> None:
    if results.chosen is not None:
        ax.scatter(
            x[results.chosen],
            y[results.chosen],
            s=150,
            marker="*",
            color=RED,
            edgecolor="white",
            linewidth=0.8,
            zorder=4,
            label="chosen",
        )


def _scale_axis(ax: Axes, axis: str, values: Array) -> None:
    """Make the axis logarithmic for values over decades; linear near zero where zeros are among them."""
    positive = values[values > 0]
    if not len(positive) or (values < 0).any():
        return
    least = float(positive.min())
    if values.max() < LOG_AXIS_RATIO * least and len(positive) == len(values):
        return
    setter = ax.set_xscale if axis == "x" else ax.set_yscale
    if len(positive) == len(values):
        setter("log")
    elif values.max() > LOG_AXIS_RATIO * np.percentile(positive, 20):
        setter("symlog", linthresh=max(least, 1e-3 * float(values.max())))


def _limits(ax: Axes, axis: str, values: Array) -> None:
    """Limit the axis to the range of the front, which designs far from it would otherwise compress."""
    if not len(values):
        return
    _scale_axis(ax, axis, values)
    low, high = float(values.min()), float(values.max())
    transform = (ax.xaxis if axis == "x" else ax.yaxis).get_transform()
    ends = transform.transform(np.array([low, high]))
    room = max(MARGIN * (ends[1] - ends[0]), 1e-9 * max(1.0, abs(ends[1])))
    first, last = transform.inverted().transform(np.array([ends[0] - room, ends[1] + room]))
    (ax.set_xlim if axis == "x" else ax.set_ylim)(float(first), float(last))


def _shown_numbers(results: Results, k: int) -> Array:
    return results.parameter_values(k) / results.study.parameters[k].scale


def _parameter_label(results: Results, k: int) -> str:
    parameter = results.study.parameters[k]
    unit = f" [{parameter.display_unit}]" if parameter.display_unit else ""
    return parameter.name.replace("_", " ") + unit


def _whole_range(ax: Axes, results: Results, k: int) -> None:
    """Show the whole range of the parameter, so that a front at its end is visible as such."""
    parameter = results.study.parameters[k]
    low, high = sorted(parameter.axis_value(x) / parameter.scale for x in (0.0, 1.0))
    room = MARGIN * (high - low) or 0.5
    ax.set_ylim(low - room, high + room)


def _ticks(ax: Axes, results: Results, k: int, axis: str) -> None:
    """Ticks at the names of a discrete parameter, or at whole numbers for counts."""
    parameter, along = results.study.parameters[k], ax.xaxis if axis == "x" else ax.yaxis
    if parameter.is_categorical:
        along.set_ticks(range(len(parameter.values)), [str(value) for value in parameter.values], fontsize="small")
        ends = (-0.5, len(parameter.values) - 0.5)
        (ax.set_xlim if axis == "x" else ax.set_ylim)(*ends)
    elif parameter.values and all(isinstance(value, int) for value in parameter.values):
        from matplotlib.ticker import MaxNLocator

        along.set_major_locator(MaxNLocator(integer=True, nbins=6))
