"""The tables of a scored catalogue: rates with Wilson bounds, reliability, confusions, coverage, time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from tests.validation.blind.scoring import wilson

from .catalogue import NOTHING
from .judging import Outcome

Pick = Callable[[Outcome], bool]
Rows = Sequence[Outcome]
BINS = 10
N_DRAWN = 500
"""Draws of what is right, from which the calibration error by chance follows."""


def _of(*categories: str) -> Pick:
    return lambda o: o.category in categories


def _alone(o: Outcome) -> bool:
    return len(o.truth["names"]) == 1 and not o.truth["foreign"] and o.category != "tiny"


def _clear(o: Outcome) -> bool:
    return o.separable and o.over_scatter >= 3


_KNOWN = ("single", "mean_single", "pair", "three", "slow_noise", "poor", "missing_channels")

FIGURES: tuple[tuple[str, str, Pick, Pick], ...] = (
    ("single, separable, 3 x scatter: exact", ">= 95 %", lambda o: _of("single")(o) and _clear(o), lambda o: o.exact),
    ("  separable, any scatter", "", lambda o: _of("single")(o) and o.separable, lambda o: o.exact),
    ("the same on the mean drive", ">= 97 %", lambda o: _of("mean_single")(o) and _clear(o), lambda o: o.exact),
    ("  separable, any scatter", "", lambda o: _of("mean_single")(o) and o.separable, lambda o: o.exact),
    ("slow noise, separable: exact", "", lambda o: _of("slow_noise")(o) and o.separable, lambda o: o.exact),
    (
        "truth within the reported set, any protocol",
        ">= 98 %",
        lambda o: _of(*_KNOWN)(o) and o.visible,
        lambda o: o.within,
    ),
    (
        "  or abstained (none, insufficient, unknown)",
        "",
        lambda o: _of(*_KNOWN)(o) and o.visible,
        lambda o: o.within or o.verdict in ("none", "insufficient", "unknown"),
    ),
    ("false alarm: nothing missing, clean or scatter", "<= 1 %", _of("clean", "scatter"), lambda o: o.alarm),
    ("false alarm: base curve within tolerance", "<= 2 %", _of("base"), lambda o: o.alarm),
    (
        "without a name, visible beyond scatter: detected",
        ">= 95 %",
        lambda o: bool(o.truth["foreign"]) and o.truth["foreign_seen"] >= 1,
        lambda o: o.detected,
    ),
    (
        "  of these, named wrongly",
        "",
        lambda o: bool(o.truth["foreign"]) and o.truth["foreign_seen"] >= 1,
        lambda o: o.wrong,
    ),
    ("known called unknown", "<= 2 %", lambda o: _of(*_KNOWN)(o) and o.separable, lambda o: o.verdict == "unknown"),
    ("known called partly", "", lambda o: _of(*_KNOWN)(o) and o.separable, lambda o: o.verdict == "partly"),
    ("two effects, separable: both exact", ">= 90 %", lambda o: _of("pair")(o) and o.separable, lambda o: o.exact),
    (
        "two effects, separable: one at least",
        ">= 99 %",
        lambda o: _of("pair")(o) and o.separable,
        lambda o: bool(o.named & set(o.truth["names"])),
    ),
    ("three effects, separable: exact", "", lambda o: _of("three")(o) and o.separable, lambda o: o.exact),
    ("an effect below a tenth of its deviation is named", "never", lambda o: True, lambda o: bool(o.negligible)),
    ("  where such an effect is hidden", "never", _of("tiny"), lambda o: bool(o.negligible)),
    ("wrong name, all cases", "", lambda o: True, lambda o: o.wrong),
    ("wrong name, poor protocols, missing channels", "", _of("poor", "missing_channels"), lambda o: o.wrong),
    ("failed with an error", "0 %", lambda o: True, lambda o: bool(o.error)),
)


def table(rows: Rows) -> str:
    """The table of the figures to reach."""
    lines = [f"{'measure':50s} {'reach':>8s} {'hits':>9s} {'rate':>7s}  95 % bounds"]
    for title, reach, picks, hits in FIGURES:
        some = [o for o in rows if picks(o)]
        lines.append(f"{title:50s} {reach:>8s} {_rate(sum(hits(o) for o in some), len(some))}")
    inside = [c for o in rows for c in o.covered.values()]
    lines.append(f"{'coverage of the 95 % intervals':50s} {'93..97 %':>8s} {_rate(sum(inside), len(inside))}")
    for title, reach, times in (
        ("time on the full protocol, s", "5 / 20", [o.seconds for o in rows if o.truth["protocol"] == "full"]),
        ("  processor, s (beside other load)", "", [o.processor for o in rows if o.truth["protocol"] == "full"]),
    ):
        if times:
            spread = f"median {np.median(times):.1f}, 90 % {np.quantile(times, 0.9):.1f}, longest {max(times):.1f}"
            lines.append(f"{title:50s} {reach:>8s}  {spread}")
    return "\n".join(lines)


def _rate(hits: int, count: int) -> str:
    low, high = wilson(hits, count)
    return f"{hits:4d}/{count:<4d} " + (
        f"{100 * hits / count:6.1f}%  {100 * low:5.1f} .. {100 * high:5.1f}" if count else "   none"
    )


def calibration(pairs: Sequence[tuple[float, bool]]) -> tuple[float, list[tuple[float, float, int, int]]]:
    """Expected calibration error over equal bins, and of every bin with entries: mean probability, frequency of being
    right, how many right, how many.

    >>> calibration([(0.9, True), (0.9, False), (0.1, False)])[0]
    0.3
    """
    said, right = np.array([p for p, _ in pairs]), np.array([r for _, r in pairs], bool)
    place = np.minimum((said * BINS).astype(int), BINS - 1)
    bins, error = [], 0.0
    for number in np.unique(place):
        own = place == number
        mean, hits, count = float(said[own].mean()), int(right[own].sum()), int(own.sum())
        error += count / len(pairs) * abs(mean - hits / count)
        bins.append((mean, hits / count, hits, count))
    return round(error, 6), bins


def calibration_by_chance(said: Sequence[float]) -> tuple[float, float]:
    """Expected calibration error of hypotheses that are right exactly as often as is said of them, since so few have
    other frequencies: its mean and its 95 % quantile.

    >>> calibration_by_chance([1.0, 0.0])
    (0.0, 0.0)
    """
    rng = np.random.default_rng(0)
    drawn = (list(zip(said, (rng.random(len(said)) < np.array(said)).tolist(), strict=True)) for _ in range(N_DRAWN))
    errors = [calibration(pairs)[0] for pairs in drawn]
    return float(np.mean(errors)), float(np.quantile(errors, 0.95))


def reliability(rows: Rows) -> str:
    """Probability said against frequency right, of the likeliest hypotheses, of all, and of named effects."""
    kinds = (
        ("likeliest hypothesis", [max(o.hypotheses) for o in rows if o.hypotheses]),
        ("all hypotheses", [pair for o in rows for pair in o.hypotheses]),
        ("named effects", [pair for o in rows for pair in o.effects]),
    )
    lines = []
    for title, pairs in kinds:
        if not pairs:
            lines.append(f"{title}: no probabilities in these answers")
            continue
        error, bins = calibration(pairs)
        mean, most = calibration_by_chance([said for said, _ in pairs])
        by_chance = f"{mean:.3f} by chance, less than {most:.3f} in 95 %"
        lines.append(
            f"{title}: expected calibration error {error:.3f} (reach 0.03; {by_chance}), {len(pairs)} probabilities"
        )
        lines += [f"  said {mean:.3f}  right {_rate(hits, count)}" for mean, _, hits, count in bins]
    # Beside something unnamed the chosen model, which does not hold it, is rejected rightly.
    values = [o.global_p for o in rows if o.global_p is not None and o.exact and not o.truth["foreign"]]
    if values:
        share = _rate(sum(p < 0.05 for p in values), len(values))
        lines.append(f"global p below 0.05 where all that is hidden is named (expected 5 %): {share}")
    else:
        lines.append("global p: absent")
    return "\n".join(lines)


def confusion(rows: Rows) -> str:
    """Truth in rows, what was said in columns, counts; what is on the diagonal stands in its own column."""
    cells = Counter((_truth(o), _said(o)) for o in rows)
    said = sorted({s for _, s in cells})
    lines = ["columns: " + ", ".join(f"{k} {name}" for k, name in enumerate(said))]
    lines.append(f"{'truth':28s}" + "".join(f"{k:4d}" for k in range(len(said))))
    for truth in sorted({t for t, _ in cells}):
        counts = (cells[truth, s] for s in said)
        lines.append(f"{truth:28s}" + "".join(f"{c:4d}" if c else "   ." for c in counts))
    return "\n".join(lines)


def _truth(o: Outcome) -> str:
    names = o.truth["names"]
    if o.truth["foreign"]:
        return "unnamed" + (" and a name" if names else "")
    if o.category in NOTHING:
        return f"nothing ({o.category})"
    return f"{len(names)} effects" if len(names) > 1 else names[0] + (" (tiny)" if o.category == "tiny" else "")


def _said(o: Outcome) -> str:
    if o.verdict not in ("named", "partly"):
        return "ambiguous, with it" if o.verdict == "ambiguous" and o.within else o.verdict
    if o.exact:
        return "exact" if o.verdict == "named" else "exact, partly"
    hidden = set(o.truth["names"])
    if len(o.named) == 1:
        return next(iter(o.named)) if not o.named & hidden else "some of them"
    return "some of them" if o.named < hidden else "these and more" if hidden and hidden < o.named else "several others"


def misses(rows: Rows, limit: int = 60) -> str:
    """Cases that are neither exact nor beyond what the record can tell, by number."""
    lines = ["case  category          truth -> said"]
    for o in rows:
        clear = o.category in NOTHING or o.separable or o.truth["foreign_seen"] >= 1
        if clear and not o.exact and not (o.truth["foreign"] and o.detected and not o.wrong):
            hidden = " + ".join([*o.truth["names"], *(["[unnamed]"] if o.truth["foreign"] else [])]) or "nothing"
            said = " + ".join(sorted(o.named))
            lines.append(f"{o.truth['number']:4d}  {o.category:16s}  {hidden} -> {o.verdict} {said}{o.error[:80]}")
    return "\n".join(lines[: limit + 1])


def counts(rows: Rows) -> str:
    """Cases by category, and how many of them are separable or visible."""
    lines = [f"{'category':20s} {'cases':>6s} {'separable':>10s} {'3 x scatter':>12s} {'unnamed, visible':>17s}"]
    for name in sorted({o.category for o in rows}):
        own = [o for o in rows if o.category == name]
        clear = sum(_clear(o) for o in own)
        seen = sum(o.truth["foreign_seen"] >= 1 for o in own)
        lines.append(f"{name:20s} {len(own):6d} {sum(o.separable for o in own):10d} {clear:12d} {seen:17d}")
    return "\n".join(lines)
