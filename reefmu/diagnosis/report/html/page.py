"""report.html: the diagnosis on the first screen, then figures and details; self-contained, without network access."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from stiffness_model.units import interval_text, quantity_text

from ....effects import find_effect
from ...analysis import Analysis
from ...fitted_values import NamedEffect
from ...schema import Diagnosis
from ..text import MEANING, cautions, faint_alternatives_text, file_name, location_text, main_parameter_text
from .elements import (
    amplitude_table,
    breakable,
    caution_box,
    command_list,
    explanation,
    figure,
    locations_table,
    losses_card,
    losses_section,
    origin_line,
    section_list,
    table,
)
from .meanings import GAP_MEANING, LOCATION_MEANING, REMAINDER_MEANING, SEARCH_MEANING, shares_text
from .next_commands import next_commands
from .origin import Origin, origin_rows
from .probability_overview import probability_overview
from .script import SCRIPT
from .style import STYLE


def report_html(found: Analysis | Diagnosis, origin: Origin | None = None, record: str = "") -> str:
    """The page as HTML. origin: what the caller knows of command and drawing; record: path of the record where `found`
    does not hold it."""
    diagnosis = found.diagnosis if isinstance(found, Analysis) else found
    source, origin = found.record.source if isinstance(found, Analysis) else record, origin or Origin()
    parts = [
        f"<h1>Diagnosis{' of ' + escape(file_name(source)) if source else ''}</h1>",
        origin_line(origin_rows(origin, source.split(", "))),
        f"<div><span class='verdict {diagnosis.verdict}'>{diagnosis.verdict}</span>"
        f"<span class=meaning>{MEANING[diagnosis.verdict]}</span></div>",
        f"<p class=lead>{escape(diagnosis.sentence)}</p>",
        probability_overview(diagnosis),
        _cards(diagnosis),
        caution_box(cautions(diagnosis)),
        command_list(
            "What to do next", next_commands(diagnosis, origin, file_name(source), ratio_known=_ratio_known(found))
        ),
    ]
    if isinstance(found, Analysis):
        parts += _figures(found)
    parts += [_effect(effect) for effect in diagnosis.effects]
    if diagnosis.effects:
        parts.append(explanation(shares_text([effect.share for effect in diagnosis.effects])))
    if diagnosis.losses is not None:
        parts += losses_section(diagnosis.losses)
    if diagnosis.alternatives:
        title = "Other explanations" if diagnosis.verdict == "ambiguous" else "What the record does not exclude"
        faint = faint_alternatives_text(diagnosis)
        shown = [_names(a) for a in diagnosis.shown_alternatives]
        parts += section_list(title, [*shown, *([faint] if faint else [])])
    if not diagnosis.hypotheses:
        parts += section_list("What to measure next", diagnosis.next_experiment)
    parts += _details(diagnosis)
    if isinstance(found, Analysis):
        parts += _method(found)
    return (
        "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
        f"<title>Diagnosis: {diagnosis.verdict}</title><style>{STYLE}</style></head>"
        f"<body>{''.join(parts)}<script>{SCRIPT}</script></body></html>\n"
    )


def _ratio_known(found: Analysis | Diagnosis) -> bool:
    return not isinstance(found, Analysis) or found.evidence.problem.base.ratio is not None


def _names(names: Sequence[str]) -> str:
    return " and ".join(f"{find_effect(n).title.lower()} ({n})" for n in names) or "nothing is missing"


# -- first screen -----------------------------------------------------------------------------------------------


def _cards(diagnosis: Diagnosis) -> str:
    gap, cards = diagnosis.gap, []
    if diagnosis.verdict != "insufficient":
        change = f"{gap.before:.3g} &rarr; {gap.after:.3g}" if diagnosis.effects else f"{gap.before:.3g}"
        lines = [f"<p class=big>{change} N.m</p>", f"<p>noise {gap.noise:.3g} N.m</p>"]
        if diagnosis.effects and gap.held_out_before is not None and gap.held_out_after is not None:
            lines.append(f"<p>in runs held out {gap.held_out_before:.3g} &rarr; {gap.held_out_after:.3g} N.m</p>")
        if gap.raw_before is not None and gap.raw_after is not None:
            raw = f"{gap.raw_before:.3g} &rarr; {gap.raw_after:.3g}" if diagnosis.effects else f"{gap.raw_before:.3g}"
            lines.append(f"<p>with the angles as measured {raw} N.m</p>")
        lines.append(explanation(GAP_MEANING))
        cards.append(("Gap between model and record, rms", lines))
    if diagnosis.effects:
        cards.append(
            (
                "One of several explanations" if diagnosis.verdict == "ambiguous" else "What is missing",
                [
                    f"<p><b>{escape(find_effect(e.name).title)}</b><br>{escape(main_parameter_text(e))}</p>"
                    for e in diagnosis.effects
                ],
            )
        )
    elif diagnosis.remainder > 0 and diagnosis.verdict == "unknown":
        lines = [f"<p class=big>{diagnosis.remainder:.3g} N.m</p>"]
        lines += [f"<p>mostly over {escape(location_text(location))}</p>" for location in diagnosis.remainder_where[:1]]
        cards.append(("Explained by no known effect", lines))
    if diagnosis.losses is not None:
        cards.append(losses_card(diagnosis.losses))
    if diagnosis.next_experiment and diagnosis.verdict != "insufficient" and not diagnosis.hypotheses:
        cards.append(("Measure next", [f"<p>{escape(diagnosis.next_experiment[0])}</p>"]))
    return (
        "<div class=cards>"
        + "".join(f"<div class=card><h3>{title}</h3>{''.join(lines)}</div>" for title, lines in cards)
        + "</div>"
    )


def _figures(found: Analysis) -> list[str]:
    from . import figures

    diagnosis, problem = found.diagnosis, found.evidence.problem
    base, chosen = found.written.base, found.written.corrected
    coordinate, place = "torque", ""
    if diagnosis.where:
        first = diagnosis.where[0]
        coordinate, place = first.coordinate, f", {100 * first.share:.0f} % of it over the {location_text(first)}"
    return [
        "<div class=row>",
        figure(
            figures.curve_figure(problem, base, chosen),
            f"Torque over twist in run {figures.widest_run(problem)[0]}, the one with the widest twist.",
        ),
        figure(
            figures.loop_figure(problem, base, chosen),
            "The same run minus the model without effects, which shows loops that the whole curve conceals. Grey: "
            "two standard deviations of the noise.",
        ),
        figure(
            figures.residual_figure(problem, base, chosen, coordinate),
            f"Where the gap lies{escape(place)}. Points are means of blocks of samples.",
        ),
        figure(
            figures.gap_figure(diagnosis.gap, bool(chosen.names)),
            "The gap, root mean square over all samples, beside the noise of one sample. Held out: runs that a second "
            "fit left out.",
        ),
        "</div>",
        figure(
            f"<div class=scroll>{figures.time_figure(problem, base, chosen)}</div>",
            "Residual, measured minus model, over the record, run after run. Shaded: runs held out.",
        ),
    ]


# -- effects --------------------------------------------------------------------------------------------------------


def _effect(effect: NamedEffect) -> str:
    e = find_effect(effect.name)
    descriptions = {p.name: p.description.replace("`", "") for p in e.parameters}
    rows = [
        [
            f"{name.replace('_', ' ')}<br><span class=small>{escape(descriptions.get(name, ''))}</span>",
            quantity_text(value.value, value.unit),
            interval_text(value.low, value.high, value.unit),
            f"<span class=warn>{escape(value.warning)}</span>",
        ]
        for name, value in effect.parameters.items()
    ]
    return (
        f"<h2>{escape(e.title)} <span class=small>({effect.name}; removes {100 * effect.share:.0f} % "
        f"of the systematic gap)</span></h2><p><code>{escape(e.equation)}</code></p>"
        + table(["parameter", "value", "95 % interval", ""], rows)
        + f"<p class=small>{escape(e.source)}</p>"
    )


# -- details --------------------------------------------------------------------------------------------------------


def _details(diagnosis: Diagnosis) -> list[str]:
    parts = []
    if diagnosis.where:
        parts += ["<h2>Where the gap lies</h2>", locations_table(diagnosis.where), explanation(LOCATION_MEANING)]
    if diagnosis.remainder_where:
        parts += [
            f"<h2>Where the remainder of {diagnosis.remainder:.3g} N.m lies</h2>",
            locations_table(diagnosis.remainder_where),
            explanation(REMAINDER_MEANING),
        ]
    if diagnosis.amplitudes:
        parts += ["<h2>Sizes in small and large cycles</h2>", amplitude_table(diagnosis.amplitudes)]
    if diagnosis.not_candidates:
        parts += [
            "<h2>Effects that this record cannot show</h2>",
            table(["effect", "reason"], [[breakable(n), escape(t)] for n, t in diagnosis.not_candidates.items()]),
        ]
    if diagnosis.indistinguishable:
        parts += [
            "<h2>Effects that this record cannot tell apart</h2>",
            table(
                ["effect", "other effect", "test that tells them apart"],
                [[breakable(a), breakable(b), escape(t)] for a, b, t in diagnosis.indistinguishable],
            ),
        ]
    return parts + section_list("Notes", diagnosis.notes)


def _method(found: Analysis) -> list[str]:
    """Details of the method: noise, scatter, the best sets with their gains."""
    problem, search, noise = found.evidence.problem, found.evidence.search, found.evidence.problem.noise
    kind = f"differences of {noise.pairs} pairs of cycles" if noise.repeated else "smoothness alone"
    runs = len(found.record.starts)
    lines = [
        f"{len(found.record)} samples in {runs} run{'s' if runs > 1 else ''}; base curve: {problem.base.kind} "
        f"{file_name(problem.base.source)}",
        f"noise {noise.torque:.3g} N.m and {quantity_text(noise.twist, 'rad')}, integrated autocorrelation "
        f"{noise.correlation.correlation_time:.3g} samples, from {kind}",
    ]
    if problem.scatter is not None:
        lines.append(
            f"tolerance scatter: {found.diagnosis.base.get('scatter_size', 0):.2g} times that of the population"
        )
    rows = [
        [breakable(", ".join(f.names) or "none"), f"{search.base.cost - f.cost:.0f}", f"{problem.excess_cost(f):.0f}"]
        for size in sorted(search.best)
        for f in search.best[size][:4]
    ]
    return [
        *section_list("Method", lines),
        table(["set of effects", "gain (-2 log likelihood)", "excess left"], rows),
        explanation(SEARCH_MEANING),
    ]
