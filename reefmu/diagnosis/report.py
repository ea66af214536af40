"""report.html: one page that a test engineer reads in a minute, then the details. No network, no scripts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from stiffness_model.units import ARCMIN, MICROMETRE

from .kernels import kernel
from .result import Diagnosis, Place, Value
from .workflow import Examined

_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#222;max-width:1080px;margin:24px auto;padding:0 16px}
h1{font-size:22px;margin:0 0 4px}h2{font-size:16px;margin:22px 0 6px;border-bottom:1px solid #ddd}
.verdict{display:inline-block;padding:2px 10px;border-radius:4px;color:#fff;font-weight:600}
.named{background:#2a7f49}.none{background:#2a7f49}.partly{background:#a56a00}.ambiguous{background:#a56a00}
.unknown{background:#b2382a}.insufficient{background:#666}
.lead{font-size:17px;margin:8px 0 14px}.row{display:flex;flex-wrap:wrap;gap:12px}.row>*{flex:1 1 420px;min-width:0}
svg{max-width:100%;height:auto}table{border-collapse:collapse;font-size:14px}
td,th{padding:3px 12px 3px 0;text-align:left;vertical-align:top}
th{font-weight:600;border-bottom:1px solid #bbb}code{background:#f3f3f3;padding:1px 4px}
.warn{color:#b2382a}.small{font-size:13px;color:#555}figure{margin:0}figcaption{font-size:13px;color:#555}
@media print{body{margin:0;max-width:none;font-size:12px}h2{break-after:avoid}figure{break-inside:avoid}}
"""
_SHOWN = {"m": (MICROMETRE, "um"), "rad": (ARCMIN, "arcmin"), "m/K": (MICROMETRE, "um/K"),
          "rad/(N.m)": (ARCMIN, "arcmin/(N.m)"), "m/rad": (1e-9, "nm/rad")}


def report_html(found: Examined | Diagnosis) -> str:
    """The page, as text."""
    d = found.diagnosis if isinstance(found, Examined) else found
    source = found.record.source if isinstance(found, Examined) else ""
    parts = [f"<h1>Diagnosis{' of ' + escape(_short(source)) if source else ''}</h1>",
             f"<p class=lead><span class='verdict {d.verdict}'>{d.verdict}</span> {escape(d.sentence)}</p>"]
    if isinstance(found, Examined):
        parts += _pictures(found)
    parts += _effects(d)
    parts += _alternatives(d)
    parts += _list("What to measure next", d.next_experiment)
    parts += _details(d)
    if isinstance(found, Examined):
        parts += _workings(found)
    return ("<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
            f"<title>Diagnosis: {d.verdict}</title><style>{_STYLE}</style></head>"
            f"<body>{''.join(parts)}</body></html>\n")


def _short(source: str) -> str:
    return source.replace("\\", "/").rsplit("/", 1)[-1]


def _pictures(found: Examined) -> list[str]:
    from . import pictures

    d, study, base, chosen = found.diagnosis, found.study, found.search.base, found.finding.chosen
    where = d.where[0].coordinate if d.where else "torque"
    gap = d.gap
    held = None
    if chosen.names and gap.held_out_before is not None and gap.held_out_after is not None:
        held = (gap.held_out_before, gap.held_out_after)
    place = f": {d.where[0].region}, {100 * d.where[0].share:.0f} % of it" if d.where else ""
    return [
        "<div class=row>",
        _figure(pictures.gap_picture(gap.before, gap.after if chosen.names else None, gap.noise, held),
                "The gap between model and record, against the noise. Held out: runs that a second fit did not see."),
        _figure(pictures.curve_picture(study, base, chosen), "Torque over twist in the widest run."),
        _figure(pictures.residual_picture(study, base, chosen, where),
                f"Where the gap lies: {where.replace('_', ' ')}{escape(place)}."),
        "</div>", _figure(pictures.time_picture(study, base, chosen), "The gap through the record."),
    ]


def _figure(picture: str, caption: str) -> str:
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def _effects(d: Diagnosis) -> list[str]:
    parts = []
    for effect in d.effects:
        e = kernel(effect.name).effect
        rows = [[name.replace("_", " "), *shown(value), f"<span class=warn>{escape(value.warning)}</span>"]
                for name, value in effect.parameters.items()]
        parts += [f"<h2>{escape(e.title)} <span class=small>({effect.name}, removes {100 * effect.share:.0f} % "
                  f"of the gap)</span></h2><p><code>{escape(e.equation)}</code></p>",
                  _table(["parameter", "value", "95 % interval", ""], rows)]
    return parts


def shown(value: Value) -> tuple[str, str]:
    """Value and interval as text, in the unit that people use."""
    factor, unit = _SHOWN.get(value.unit, (1.0, value.unit))
    unit = "" if unit == "1" else " " + unit
    return (f"{value.value / factor:.4g}{unit}", f"{value.low / factor:.4g} ... {value.high / factor:.4g}{unit}")


def _alternatives(d: Diagnosis) -> list[str]:
    if not d.alternatives:
        return []
    return _list("What else it could be", [" and ".join(a) for a in d.alternatives])


def _list(title: str, lines: Iterable[str]) -> list[str]:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return [f"<h2>{title}</h2><ul>{items}</ul>"] if items else []


def _details(d: Diagnosis) -> list[str]:
    parts = []
    if d.where:
        parts += ["<h2>Where the gap lies</h2>", _places(d.where)]
    if d.remainder_where:
        parts += [f"<h2>What is left: {d.remainder:.3g} N.m</h2>", _places(d.remainder_where)]
    if d.not_candidates:
        parts += ["<h2>What this record cannot show</h2>",
                  _table(["effect", "why"], [[n, escape(t)] for n, t in d.not_candidates.items()])]
    if d.twins:
        parts += ["<h2>What this record cannot tell apart</h2>",
                  _table(["one", "the other", "what splits them"], [[a, b, escape(t)] for a, b, t in d.twins])]
    parts += _list("Notes", d.notes)
    return parts


def _places(places: Sequence[Place]) -> str:
    return _table(["coordinate", "strongest at", "share of the gap"],
                  [[p.coordinate.replace("_", " "), escape(p.region), f"{100 * p.share:.0f} %"] for p in places])


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    top = "".join(f"<th>{h}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{body}</table>"


def _workings(found: Examined) -> list[str]:
    """How it was found: noise, scatter, the best sets with their costs, why sets were refused."""
    study, search, n = found.study, found.search, found.study.noise
    kind = f"differences of {n.pairs} pairs of cycles" if n.repeated else "smoothness alone"
    lines = [f"{len(found.record)} samples in {len(found.record.starts)} runs; base curve: {study.base.kind} "
             f"{_short(study.base.source)}",
             f"noise {n.torque:.3g} N.m and {n.twist / ARCMIN:.3g} arcmin, integrated autocorrelation "
             f"{n.correlation:.3g} samples, from {kind}",
             f"size of the tolerance scatter: {found.diagnosis.base.get('scatter_size', 0):.2g} of the population's"]
    rows = [[", ".join(f.names) or "none", f"{search.base.cost - f.cost:.0f}", f"{study.excess(f):.0f}"]
            for size in sorted(search.best) for f in search.best[size][:4]]
    reasons = [f"{', '.join(j.fit.names)}: {name} {why}" for j in found.finding.examined
               for name, why in j.reasons.items()]
    return [*_list("How it was found", lines),
            _table(["set of effects", "gain (-2 log likelihood)", "excess left"], rows),
            *_list("Sets refused", reasons)]
