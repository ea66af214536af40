"""The page of a drive: its curve, equations, variables and advice; with a compiler it runs the drive."""

from __future__ import annotations

import base64
import importlib.resources
import json
import re
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from stiffness_model.units import ARCMIN, displayed

from ..model.component import Component
from ..model.nominals import twist_at_full_torque
from ..model.start.start_parameters import START_TWIST
from ..model.variables import Interface
from .curve_picture import RANGE, curve_svg, rest_curve
from .web_assembly import NO_COMPILER

if TYPE_CHECKING:
    from reefmu.model.parameters import ModelParameter

_READINGS = (
    ("twist", "twist", "arcmin", "twist"),
    ("torque", "torque on the output", "N.m", "output.tau"),
    ("stiffness", "stiffness", "N.m/arcmin", "stiffness"),
    ("force", "greatest contact force", "N", "max_contact_force"),
    ("share", "greatest load share", "%", "load_share"),
)
"""Readings below the plot: name, label, unit, and the output on which it depends."""


def drive_page(
    drive: Component, interface: Interface, description: str, module: bytes | None, sections: Sequence[str] = ()
) -> str:
    """The whole page, self-contained.

    drive: of kind `drive`; interface: its variables, or those of the joint around it, for the table. module:
    WebAssembly that `web_assembly.compile_module` made of this drive, None for a page that does not run it. sections:
    HTML to insert before the table of variables.
    """
    name = escape(drive.name)
    picture = f"<h2>Torque over twist</h2>\n{_picture(drive)}\n"
    live = (
        f'<p class="soft">{escape(NO_COMPILER, quote=False)}</p>\n' if module is None else _interactive(drive, module)
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{name}</title>\n'
        f"<style>\n{_asset('page.css')}</style>\n</head>\n<body>\n<h1>{name}</h1>\n<p>{_prose(description)}</p>\n"
        f"{live}{picture}{_equations(drive, interface.kind)}{_signs()}{''.join(sections)}{_variables(interface)}"
        "</body>\n</html>\n"
    )


def _prose(text: str) -> str:
    """Text as HTML, with names between backticks as code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(text))


def _clauses(equation: str) -> str:
    """An equation with a line for each of its clauses."""
    return equation.replace(",  ", "\n")


def _asset(name: str) -> str:
    return (importlib.resources.files("reefmu.fmu.documentation") / name).read_text("utf-8")


def _picture(drive: Component) -> str:
    curve = rest_curve(drive)
    note = (
        "The mean of the population at rest, and the band from its 10th to its 90th percentile."
        if len(curve.torque) > 1
        else "At rest, without history."
    )
    return f"<div class='wide'>{curve_svg(curve)}</div>\n<p class='soft'>{note}</p>"


def _interactive(drive: Component, module: bytes) -> str:
    """The part of the page that runs the drive, with its data, module and script."""
    outputs = [signal.name for signal in drive.outputs]
    names = [signal.name for signal in (*drive.inputs, *drive.outputs)]
    first = len(names)
    twist = twist_at_full_torque(drive)
    content = {
        "count": first + len(drive.parameters) + 2 * len(drive.states),
        "references": {name: k for k, name in enumerate(names)},
        "inputs": names[: len(drive.inputs)],
        "outputs": outputs,
        "ratio": next(p.value for p in drive.parameters if p.name == "ratio"),
        "twist": twist,
        "range": RANGE * twist,
        "parameters": [
            {"name": p.name, "reference": first + k, "value": p.value} for k, p in enumerate(drive.parameters)
        ],
    }
    readings = "".join(
        f'<span>{label} <b id="read-{key}"></b> {unit}</span>\n'
        for key, label, unit, output in _READINGS
        if output in outputs
    )
    limit = RANGE * twist / ARCMIN
    crank = (
        '<label>crank angle <input type="range" id="crank-slider" min="0" max="360" step="any" value="0"></label>\n'
        if drive.model.individual is not None or _reads_crank(drive)
        else ""
    )
    fields = "".join(_field(p) for p in drive.parameters if p.tunable and p.minimum != p.maximum)
    return (
        "<h2>The drive</h2>\n<p>Move the slider, or drag in the plot: this page runs the model itself, with its "
        "friction and its memory. The grey line is the drive at rest, without history.</p>\n"
        '<div class="drive">\n<canvas id="plot"></canvas>\n<p id="drive-error"></p>\n'
        f'<input type="range" id="twist-slider" aria-label="twist" min="{-limit:.6g}" max="{limit:.6g}" step="any" '
        f'value="0">\n<div class="readings">\n{readings}</div>\n'
        '<button id="run-loop">Run two loops</button> to '
        f'<input type="number" id="loop-size" min="0" max="{limit:.4g}" step="any" value="{twist / ARCMIN:.3g}"> '
        'arcmin <button id="clear">Start anew</button>\n'
        f"{crank}{fields}<button id='defaults'>Values of the model</button>\n</div>\n"
        f'<script type="application/json" id="drive-data">{json.dumps(content)}</script>\n'
        f'<script type="text/plain" id="drive-module">{base64.b64encode(module).decode()}</script>\n'
        f"<script>\n{_asset('interactive.js')}</script>\n"
    )


def _reads_crank(drive: Component) -> bool:
    """Whether the torque at constant twist depends on the crank's angle."""
    return any(effect.name in ("kinematic_error", "missing_ball") for effect in drive.model.effects)


def _field(p: ModelParameter) -> str:
    # In the unit that suits a value of typical size: arcmin for a twist, deg for a phase.
    typical = p.nominal or 1.0
    size = displayed(typical, p.unit)
    shown = typical / size[0]
    low, high, value = (None if v is None else v / shown for v in (p.minimum, p.maximum, p.value))
    limits = "".join(f' {name}="{v!r}"' for name, v in (("min", low), ("max", high)) if v is not None)
    return (
        f'<label><input type="number" step="any" data-parameter="{escape(p.name)}" data-size="{shown!r}"{limits} '
        f'value="{_number(value)}"> {escape(size[1] if size[1] != "1" else "")} <code>{escape(p.name)}</code> '
        f'<span class="soft">{escape(p.description)}</span></label>\n'
    )


def _equations(drive: Component, kind: str) -> str:
    model = drive.model
    contacts = (
        "the equilibrium of one drive's own contacts"
        if model.individual is not None
        else "a table over twist and clearance, from the equilibrium of every contact of many virtual drives"
        if model.lookup.has_contacts
        else "the lines of its curve"
    )
    effects = "".join(
        f"<li>{escape(e.title)} (<code>{escape(e.name)}</code>), {escape(e.place.value)}:\n"
        f"<pre>{escape(_clauses(e.equation))}</pre></li>\n"
        for e in model.effects
    )
    motion = (
        "\nmotor.inertia d(crank.w)/dt  = motor.tau - motor.damping crank.w + crank.tau"
        "\nload.inertia  d(output.w)/dt = load.tau - load.damping output.w + output.tau"
    )
    listed = f"<p>Effects that the contacts leave out, in the order along the drive:</p>\n<ul>\n{effects}</ul>\n"
    start = "" if kind == "joint" else f" + {START_TWIST}"
    return (
        f"<h2>Equations</h2>\n<pre>twist      = crank.phi/ratio - output.phi{start}\n"
        "output.tau = T(twist, clearance)          torque of the contacts, and of the effects\n"
        "crank.tau  = -output.tau/ratio            without friction\n"
        f"stiffness  = d output.tau / d twist       with states held"
        f"{motion if kind == 'joint' else ''}</pre>\n<p>T is {contacts}.</p>\n"
        f"{listed if effects else ''}"
    )


def _signs() -> str:
    return (
        "<h2>Signs and units</h2>\n<p>Variables are in SI units. Torques are those that the drive exerts: "
        "<code>output.tau</code> is positive on the output for a positive twist. The ratio is signed: it is negative "
        "where crank and output turn in opposite senses.</p>\n"
    )


def _variables(interface: Interface) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(v.name)}</code></td><td>{v.causality}</td><td>{escape(v.unit)}</td>"
        f"<td class='number'>{_number(v.start)}</td><td class='number'>{_bounds(v.minimum, v.maximum)}</td>"
        f"<td>{escape(v.description)}</td></tr>\n"
        for v in interface.variables
        if not v.derivative_of
    )
    return (
        "<h2>Variables</h2>\n<div class='table'><table>\n<tr><th>name</th><th>causality</th><th>unit</th><th>start</th>"
        f"<th>from, to</th><th>meaning</th></tr>\n{rows}</table></div>\n"
    )


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _bounds(low: float | None, high: float | None) -> str:
    return "" if low is None and high is None else f"{_number(low)}, {_number(high)}"
