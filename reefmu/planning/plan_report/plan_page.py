"""plan.html: what the protocol would tell on the first screen, then figures and tables; self-contained."""

from __future__ import annotations

from html import escape

from stiffness_model.units import quantity_text

from ...diagnosis.report.html.elements import figure, table
from ...diagnosis.report.html.script import SCRIPT
from ...diagnosis.report.html.style import STYLE
from ...effects import find_effect
from ..protocols.schedule import duration_text
from ..remedies import NOTHING
from ..shortest_plan import Plan
from . import plan_figures
from .result import DETECTED, limits, remedy_for_excluded, summary


def plan_html(plan: Plan) -> str:
    """The page as HTML."""
    parts = [
        f"<h1>Test plan for {escape(plan.drive.name)} on {escape(plan.rig.name)}</h1>",
        f"<p class=lead>{escape(summary(plan))}</p>",
        _cards(plan),
        figure(plan_figures.protocol_figure(plan), "Set points of protocol.csv. Shaded: crank turning, or warm."),
        "<h2>Predicted isolability</h2>",
        figure(
            plan_figures.matrix_figure(plan),
            "Probability, %, that the diagnosis names the effect of a column while that of a row is true at its "
            "typical size, with random shape parameters, on an individual drive of the population. It holds "
            "for laws and a covariance that are those of the model.",
        ),
        "<h2>Detection limits</h2>",
        figure(
            plan_figures.power_figure(plan),
            f"Sizes from which an effect is detected ({100 * DETECTED:.0f} %) beside noise and tolerance scatter, and "
            f"named ({100 * plan.power:.0f} %) among all rivals.",
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
        f"<title>Test plan: {escape(plan.drive.name)}</title><style>{STYLE}</style></head>"
        f"<body>{''.join(parts)}<script>{SCRIPT}</script></body></html>\n"
    )


def _cards(plan: Plan) -> str:
    found = plan.isolability
    false_alarm = 1 - float(found.matrix[0, -1])
    wrong = [
        1 - float(found.matrix[1 + k, found.names.index(n)] + found.matrix[1 + k, -1]) for k, n in enumerate(found.true)
    ]
    cards = [
        ("Duration", [f"<p class=big>{duration_text(plan.seconds)}</p>", f"<p>of {plan.rig.minutes:g} min</p>"]),
        (
            "False alarms",
            [f"<p class=big>{100 * false_alarm:.1f} %</p>", "<p>predicted, of drives that lack nothing</p>"],
        ),
        (
            "Wrong names",
            [f"<p class=big>{100 * max(0.0, *wrong):.1f} %</p>", "<p>predicted at most, over the effects</p>"],
        ),
    ]
    return (
        "<div class=cards>"
        + "".join(f"<div class=card><h3>{title}</h3>{''.join(lines)}</div>" for title, lines in cards)
        + "</div>"
    )


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
    return table(["effect", "parameter", "typical size", "detected from", "named from", "named at typical size"], rows)


def _untold(plan: Plan) -> list[str]:
    """What the protocol does not tell, and what could."""
    rows = [
        [
            escape(r.effect),
            "does not show" if r.rival == NOTHING else escape(r.rival),
            escape(r.remedy or "nothing offered here"),
        ]
        for r in plan.remedies
    ]
    rows += [
        [escape(name), "is no candidate: " + escape(why), escape(remedy_for_excluded(name))]
        for name, why in plan.excluded.items()
    ]
    if not rows:
        return []
    return ["<h2>What it does not tell</h2>", table(["effect", "not told from", "what could tell"], rows)]


def _runs(plan: Plan) -> str:
    rows = [
        [str(k + 1), f"{begin:.0f}", f"{piece.seconds:.3g}", str(len(piece)), escape(piece.label)]
        for k, (begin, piece) in enumerate(zip(plan.schedule.begin, plan.schedule.pieces, strict=True))
    ]
    return table(["run", "begins [s]", "lasts [s]", "samples", "motion"], rows)


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
    return table(["rig", ""], rows)
