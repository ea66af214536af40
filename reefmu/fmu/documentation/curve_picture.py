"""Torque over twist as a picture in SVG, from a component."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN

from ..model.component import Component
from ..model.nominals import twist_at_full_torque

POINTS = 121
"""Points of a curve, chosen by judgement."""
RANGE = 1.1
"""Greatest twist shown, relative to the one at full torque; chosen by judgement."""
_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 640, 360, 64, 44, 12


@dataclass(frozen=True)
class RestCurve:
    """A drive at rest at every twist, without history. twist: rad; torque: N.m, by band (0, -1, 1)."""

    twist: Array
    torque: dict[float, Array]


def rest_curve(component: Component) -> RestCurve:
    """The curve of a component of kind `drive`, with the percentiles of a population that has them."""
    names = [signal.name for signal in component.inputs]
    band = next(k for k, p in enumerate(component.parameters) if p.name == "band")
    column = [signal.name for signal in component.outputs].index("output.tau")
    twist = np.linspace(-1, 1, POINTS) * RANGE * twist_at_full_torque(component)
    inputs = np.tile([float(signal.start) for signal in component.inputs], (POINTS, 1))
    inputs[:, names.index("output.phi")] = -twist
    p = component.parameter_vector()
    bands = (p[band],) if component.parameters[band].minimum == component.parameters[band].maximum else (0.0, -1.0, 1.0)
    torque: dict[float, Array] = {}
    for value in bands:
        p[band] = value
        rows = [np.asarray(component.output(component.initial(u, p), u, p)).ravel()[column] for u in inputs]
        torque[float(value)] = np.array(rows)
    return RestCurve(twist, torque)


def curve_svg(curve: RestCurve) -> str:
    """The picture: the curve, and the band between the percentiles as an area."""
    x, highest = curve.twist / ARCMIN, max(float(np.abs(t).max()) for t in curve.torque.values())
    x_step, y_step = _tick_step(float(x[-1])), _tick_step(highest)

    def at(u: float, v: float) -> str:
        across = _LEFT + (u / float(x[-1]) + 1) / 2 * (_WIDTH - _LEFT - 12)
        return f"{across:.1f},{_TOP + (1 - v / highest) / 2 * (_HEIGHT - _TOP - _BOTTOM):.1f}"

    def path(torque: Array) -> str:
        return " ".join(at(u, v) for u, v in zip(x.tolist(), torque.tolist(), strict=True))

    parts = []
    for k in range(-int(x[-1] / x_step), int(x[-1] / x_step) + 1):
        ends = [at(k * x_step, v) for v in (-highest, highest)]
        left = ends[0].split(",")[0]
        parts.append(f'<polyline class="grid" points="{" ".join(ends)}"/>')
        parts.append(f'<text x="{left}" y="{_HEIGHT - _BOTTOM + 18}" text-anchor="middle">{k * x_step:g}</text>')
    for k in range(-int(highest / y_step), int(highest / y_step) + 1):
        ends = [at(u, k * y_step) for u in (float(x[0]), float(x[-1]))]
        height = float(ends[0].split(",")[1]) + 4
        parts.append(f'<polyline class="grid" points="{" ".join(ends)}"/>')
        parts.append(f'<text x="{_LEFT - 8}" y="{height:.1f}" text-anchor="end">{k * y_step:g}</text>')
    if len(curve.torque) > 1:
        there, back = path(curve.torque[1.0]).split(), path(curve.torque[-1.0]).split()
        parts.append(f'<polygon class="band" points="{" ".join([*there, *reversed(back)])}"/>')
    parts.append(f'<polyline class="curve" points="{path(next(iter(curve.torque.values())))}"/>')
    parts.append(f'<text x="{_WIDTH / 2}" y="{_HEIGHT - 6}" text-anchor="middle">twist [arcmin]</text>')
    parts.append(f'<text transform="translate(14 {_HEIGHT / 2}) rotate(-90)" text-anchor="middle">torque [N.m]</text>')
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="torque over twist">\n'
        + "\n".join(parts)
        + "\n</svg>"
    )


def _tick_step(greatest: float) -> float:
    """1, 2 or 5 times a power of ten, so that there are two to five ticks up to `greatest`.

    >>> _tick_step(8.0), _tick_step(310.0)
    (2.0, 100.0)
    """
    power = 10.0 ** math.floor(math.log10(greatest))
    return next(m * power for m in (0.2, 0.5, 1.0, 2.0, 5.0) if greatest / (m * power) <= 5)
