"""plan.html: what the protocol would tell on the first screen, then figures and tables; without network or scripts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

from ...diagnosis.report.text import quantity_text
from ...effects import find_effect
from ..plan import Plan
from ..remedies import NOTHING
from . import figures
from .result import limits

_STYLE = """
*{box-sizing:border-box}
body{font:15px/1.45 system-ui,"DejaVu Sans",sans-serif;color:#222;max-width:1120px;margin:20px auto;padding:0 16px}
h1{font-size:15px;font-weight:400;color:#555;margin:0 0 6px;overflow-wrap:anywhere}
h2{font-size:16px;margin:22px 0 6px;border-bottom:1px solid #ddd}
.lead{font-size:18px;line-height:1.4;margin:8px 0 14px;overflow-wrap:anywhere}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(300px,100%),1fr));gap:12px}
.card{border:1px solid #ddd;border-radius:6px;padding:8px 12px}
.card h3{font-size:12px;letter-spacing:.04em;text-transform:uppercase;color:#555;margin:0 0 4px}
.card p{margin:2px 0}.big{font-size:20px;font-weight:600}
svg{max-width:100%;height:auto;display:block}figure{margin:14px 0 0}figcaption{font-size:13px;color:#555}
.table{overflow-x:auto}table{border-collapse:collapse;font-size:14px}
td,th{padding:3px 14px 3px 0;text-align:left;vertical-align:top;overflow-wrap:anywhere}
th{font-weight:600;border-bottom:1px solid #bbb;overflow-wrap:normal}.small{font-size:13px;color:#555}
@page{size:A4;margin:14mm}
@media print{body{margin:0;max-width:none;font-size:11px;padding:0}.lead{font-size:14px}h2{break-after:avoid}
figure,.card,tr{break-inside:avoid}table{font-size:10px}*{print-color-adjust:exact}}
"""


def plan_html(plan: Plan) -> str:
    """The page as HTML."""
    parts = [
        f"<h1>Test plan for {escape(plan.drive.name)} on {escape(plan.rig.name)}</h1>",
        f"<p class=lead>{escape(summary(plan))}</p>",
        _cards(plan),
        _figure(figures.protocol_figure(plan), "Set points of protocol.csv. Shaded: crank turning, or warm."),
        "<h2>Predicted isolability</h2>",
        _figure(
            figures.matrix_figure(plan),
            "Probability, %, that the diagnosis names the effect of a column while that of a row is true at its "
            "typical size, with random shape parameters, on an individual drive of the population.",
        ),
        "<h2>Detection limits</h2>",
        _figure(
            figures.power_figure(plan),
            f"Sizes from which an effect is detected (95 %) beside noise and tolerance scatter, and named "
            f"({100 * plan.power:.0f} %) among all rivals.",
        ),
        _limits(plan),
        *_untold(plan),
        "<h2>Runs</h2>",
        _runs(plan),
        "<h2>Rig</h2>",
        _rig(plan),
    ]
    return (
        "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
        f"<title>Test plan: {escape(plan.drive.name)}</title><style>{_STYLE}</style></head>"
        f"<body>{''.join(parts)}</body></html>\n"
    )


def summary(plan: Plan) -> str:
    """The result in one or two sentences."""
    told = [name for name in plan.isolability.true if plan.isolability.named_right(name) >= plan.power]
    total, minutes = len(plan.isolability.true), math.ceil(plan.seconds / 60)
    text = (
        f"{len(plan.schedule)} runs in {minutes} min name {len(told)} of {total} effects of typical size with a "
        f"probability of {100 * plan.power:.0f} % or more."
    )
    others = [name for name in plan.isolability.true if name not in told]
    return text + (f" Less probable: {', '.join(others)}." if others else "")


def _cards(plan: Plan) -> str:
    found = plan.isolability
    false_alarm = 1 - float(found.matrix[0, -1])
    wrong = [
        1 - float(found.matrix[1 + k, found.names.index(n)] + found.matrix[1 + k, -1]) for k, n in enumerate(found.true)
    ]
    cards = [
        ("Duration", [f"<p class=big>{plan.seconds / 60:.1f} min</p>", f"<p>of {plan.rig.minutes:g} min</p>"]),
        ("False alarm", [f"<p class=big>{100 * false_alarm:.1f} %</p>", "<p>of drives with nothing missing</p>"]),
        ("Wrong name", [f"<p class=big>{100 * max(0.0, *wrong):.1f} %</p>", "<p>at most, over the true effects</p>"]),
    ]
    return (
        "<div class=cards>"
        + "".join(f"<div class=card><h3>{title}</h3>{''.join(lines)}</div>" for title, lines in cards)
        + "</div>"
    )


def _figure(picture: str, caption: str) -> str:
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def _limits(plan: Plan) -> str:
    rows = [
        [
            escape(find_effect(limit.effect).title),
            limit.effect + "." + limit.parameter,
            quantity_text(limit.typical, limit.unit),
            quantity_text(limit.detected_from, limit.unit),
            "-" if limit.named_from is None else quantity_text(limit.named_from, limit.unit),
            f"{100 * limit.named_at_typical:.0f} %",
        ]
        for limit in limits(plan)
    ]
    return _table(["effect", "parameter", "typical size", "detected from", "named from", "named at typical size"], rows)


def _untold(plan: Plan) -> list[str]:
    """What the protocol does not tell, and what would."""
    rows = [
        [
            escape(r.effect),
            "does not show" if r.rival == NOTHING else escape(r.rival),
            escape(r.remedy or "nothing offered here"),
        ]
        for r in plan.remedies
    ]
    rows += [
        [escape(name), "is no candidate: " + escape(why), "a sensor for it"] for name, why in plan.excluded.items()
    ]
    if not rows:
        return []
    return ["<h2>What it does not tell</h2>", _table(["effect", "not told from", "what would tell"], rows)]


def _runs(plan: Plan) -> str:
    rows = [
        [str(k + 1), f"{begin / 60:.1f}", f"{piece.seconds:.3g}", str(len(piece)), escape(piece.label)]
        for k, (begin, piece) in enumerate(zip(plan.schedule.begin, plan.schedule.pieces, strict=True))
    ]
    return _table(["run", "begins [min]", "lasts [s]", "samples", "motion"], rows)


def _rig(plan: Plan) -> str:
    rig = plan.rig
    assert rig.torque is not None
    assert rig.torque_noise is not None
    crank = {"turns": f"turns, up to {rig.speed:g} rad/s", "angles": "locked at any angle", "locked": "locked"}[
        rig.crank
    ]
    rows = [
        ["greatest torque", quantity_text(rig.torque, "N.m")],
        ["crank", crank],
        ["temperature", f"{rig.lowest:g} ... {rig.highest:g} degC" if rig.can_heat else "not varied"],
        ["torque sensor, noise of a sample", quantity_text(rig.torque_noise, "N.m")],
        ["output encoder, noise of a sample", quantity_text(rig.output_noise, "rad")],
        ["crank encoder, noise of a sample", quantity_text(rig.crank_noise, "rad")],
        ["sampling rate, greatest", f"{rig.sample_rate:g} Hz"],
    ]
    return _table(["rig", ""], rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    top = "".join(f"<th>{h}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<div class=table><table><tr>{top}</tr>{body}</table></div>"
