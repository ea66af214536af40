"""Scores of diagnoses: outcomes of cases, rates with Wilson intervals, and the table of figures."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .records import Truth

WITH_NAMES = ("named", "partly")
CLEAN = ("none", "scatter", "base")
"""Categories without hidden effects."""
_UNITS = {"": 1.0, "1": 1.0, "um": 1e-6, "µm": 1e-6, "mm": 1e-3, "arcmin": math.pi / 10800, "mrad": 1e-3, "%": 0.01}
# Parameters with the same meaning in generator and diagnosis, although the constitutive laws differ.
COVERED = {
    "backlash": ("clearance",),
    "preload": ("clearance",),
    "thermal_clearance": ("rate",),
    "wear": ("rate",),
    "modulus_error": ("error",),
    "hysteresis": ("torque",),
    "load_dependent_hysteresis": ("fraction",),
    "coulomb_friction": ("torque",),
    "viscous_friction": ("coefficient",),
    "damping": ("coefficient",),
    "torque_sensor_offset": ("torque",),
    "structural_compliance": ("compliance",),
    "kinematic_error": ("amplitude_1", "amplitude_2", "amplitude_3", "amplitude_4"),
}


@dataclass(frozen=True)
class Outcome:
    """One judged diagnosis. exact: all true names and no others are named; within: the true set is named or among the
    alternatives; wrong: a name is not true; held_out: held-out gap of the corrected model over the true noise; covered:
    of every comparable parameter, whether its interval contains the truth; error: message of a diagnosis that failed.
    """

    truth: Truth
    verdict: str
    named: tuple[str, ...]
    exact: bool
    within: bool
    wrong: bool
    held_out: float | None
    covered: Mapping[str, bool]
    seconds: float
    error: str = ""

    @property
    def weakest(self) -> float:
        """Size of the smallest hidden effect over the noise."""
        return min(self.truth.sigmas.values(), default=0.0)

    @property
    def weakest_over_scatter(self) -> float:
        """Size of the smallest hidden effect over the scatter of individuals."""
        return min(self.truth.scatter_sigmas.values(), default=0.0)


def judge(truth: Truth, answer: Mapping[str, Any], seconds: float) -> Outcome:
    """Compare a diagnosis, in the form of diagnosis.json, with the truth."""
    verdict, effects = str(answer["verdict"]), answer.get("effects") or []
    named, hidden = {e["name"] for e in effects}, set(truth.effects)
    sets = [named, *(set(alternative) for alternative in answer.get("alternatives") or [])]
    finding = verdict in WITH_NAMES
    nothing = not hidden and not truth.outside and verdict == "none"
    gap = answer.get("gap") or {}
    after = gap.get("held_out_after")
    exact = nothing or (finding and bool(hidden) and named == hidden)
    return Outcome(
        truth,
        verdict,
        tuple(sorted(named)),
        exact,
        exact or (verdict in (*WITH_NAMES, "ambiguous") and bool(hidden) and hidden in sets),
        finding and not named <= hidden,
        None if after is None else float(after) / truth.noise,
        _covered(truth, effects) if exact else {},
        seconds,
    )


def failed(truth: Truth, error: str, seconds: float) -> Outcome:
    """The outcome of a diagnosis that raised an error."""
    return Outcome(truth, "error", (), False, False, False, None, {}, seconds, error)


def _covered(truth: Truth, effects: Iterable[Mapping[str, Any]]) -> dict[str, bool]:
    out = {}
    for effect in effects:
        name = effect["name"]
        for parameter in COVERED.get(name, ()):
            found, real = effect["parameters"].get(parameter), truth.parameters[name].get(parameter)
            if found is None or real is None:
                continue
            unit = _UNITS.get(str(found.get("unit", "")).split("/")[0], 1.0)
            out[f"{name}.{parameter}"] = bool(found["low"] * unit <= real <= found["high"] * unit)
    return out


def wilson(hits: int, count: int, z: float = 1.96) -> tuple[float, float]:
    """Bounds of the Wilson interval of a rate, of 95 % by default.

    >>> [round(b, 3) for b in wilson(97, 100)]
    [0.915, 0.99]
    """
    if count == 0:
        return 0.0, 1.0
    p, q = hits / count, z * z / count
    middle, half = p + q / 2, z * math.sqrt(p * (1 - p) / count + q / count / 4)
    return max(0.0, (middle - half) / (1 + q)), min(1.0, (middle + half) / (1 + q))


Rows = list[Outcome]
Pick = Callable[[Outcome], bool]


def _is(*categories: str) -> Pick:
    return lambda o: o.truth.case.category in categories


def _shown(o: Outcome, sigmas: float) -> bool:
    return o.truth.separable and o.weakest >= 0.97 * sigmas and o.truth.case.sensors.correlation <= 0.9


def _alarm(o: Outcome) -> bool:
    return o.verdict not in ("none", "insufficient")


def _detected(o: Outcome) -> bool:
    return o.verdict in ("unknown", "partly")


_SINGLE = ("single", "sweep")
FIGURES: tuple[tuple[str, str, Pick, Pick], ...] = (
    ("single, separable, >= 3 sigma: exact", ">= 97 %", lambda o: _is(*_SINGLE)(o) and _shown(o, 3), lambda o: o.exact),
    (
        "  of these, >= 3 times the scatter",
        "",
        lambda o: _is(*_SINGLE)(o) and _shown(o, 3) and o.weakest_over_scatter >= 3,
        lambda o: o.exact,
    ),
    ("single, separable, 1 sigma: exact", ">= 90 %", lambda o: _is("single_1")(o) and _shown(o, 1), lambda o: o.exact),
    (
        "  of these, >= 1 times the scatter",
        "",
        lambda o: _is("single_1")(o) and _shown(o, 1) and o.weakest_over_scatter >= 1,
        lambda o: o.exact,
    ),
    (
        "autocorrelation 0.93 to 0.97: exact",
        "",
        lambda o: _is("autocorrelated")(o) and o.truth.separable,
        lambda o: o.exact,
    ),
    (
        "truth within the reported set, any protocol",
        ">= 98 %",
        lambda o: not _is(*CLEAN, "floor", "outside", "outside_and")(o) and o.weakest >= 0.97,
        lambda o: o.within,
    ),
    (
        "  or abstained (insufficient, none, unknown)",
        "",
        lambda o: not _is(*CLEAN, "floor", "outside", "outside_and")(o) and o.weakest >= 0.97,
        lambda o: o.within or o.verdict in ("insufficient", "none", "unknown"),
    ),
    ("false alarm: clean", "<= 1 %", _is("none"), _alarm),
    ("false alarm: tolerance scatter alone", "<= 1 %", _is("scatter"), _alarm),
    ("false alarm: curve off within the tolerances", "", _is("base"), _alarm),
    ("discrepancy without a name: detected", ">= 95 %", _is("outside", "outside_and"), _detected),
    (
        "known effects called unknown",
        "<= 3 %",
        lambda o: _is(*_SINGLE, "pair", "three")(o) and _shown(o, 3),
        lambda o: o.verdict == "unknown",
    ),
    (
        "known effects called partly",
        "",
        lambda o: _is(*_SINGLE, "pair", "three")(o) and _shown(o, 3),
        lambda o: o.verdict == "partly",
    ),
    ("two effects: both exact", ">= 90 %", lambda o: _is("pair")(o) and o.truth.separable, lambda o: o.exact),
    (
        "two effects: at least one named",
        ">= 99 %",
        lambda o: _is("pair")(o) and o.truth.separable,
        lambda o: bool(set(o.named) & set(o.truth.effects)),
    ),
    (
        "  two, each >= 3 times the scatter: exact",
        "",
        lambda o: _is("pair")(o) and o.truth.separable and o.weakest_over_scatter >= 3,
        lambda o: o.exact,
    ),
    ("three effects: exact", "", lambda o: _is("three")(o) and o.truth.separable, lambda o: o.exact),
    ("wrong name over the noise sweep, 0.05 to 2 %", "<= 3 %", _is("sweep"), lambda o: o.wrong),
    ("wrong name, all cases", "", lambda o: True, lambda o: o.wrong),
    ("wrong name, limited protocols, missing columns", "", _is("poor", "missing"), lambda o: o.wrong),
    (
        "on an individual, >= 3 times the scatter: exact",
        ">= 90 %",
        lambda o: _is("individual")(o) and _shown(o, 3) and o.weakest_over_scatter >= 2.9,
        lambda o: o.exact,
    ),
    ("failed with an error", "0 %", lambda o: True, lambda o: bool(o.error)),
)


def figures(rows: Rows) -> str:
    """The table of the rates, beside their goals."""
    lines = [f"{'measure':50s} {'goal':>8s} {'hits':>9s} {'rate':>7s}  95 % bounds"]
    for title, goal, picks, hits in FIGURES:
        some = [o for o in rows if picks(o)]
        count = sum(hits(o) for o in some)
        low, high = wilson(count, len(some))
        rate = f"{100 * count / len(some):6.1f}%  {100 * low:5.1f} .. {100 * high:5.1f}" if some else "   none"
        lines.append(f"{title:50s} {goal:>8s} {count:4d}/{len(some):<4d} {rate}")
    # On an individual the gap contains its scatter beside the noise.
    gaps = sorted(
        o.held_out
        for o in rows
        if o.held_out is not None and o.exact and o.truth.effects and not o.truth.case.individual
    )
    if gaps:
        lines.append(
            f"{'held-out gap over the true noise, exact, mean drive':50s} {'<= 1.1':>8s}  "
            f"median {_at(gaps, 0.5):.3f}, 90 % {_at(gaps, 0.9):.3f}, greatest {gaps[-1]:.3f}"
        )
    inside = [c for o in rows for c in o.covered.values()]
    low, high = wilson(sum(inside), len(inside))
    if inside:
        lines.append(
            f"{'coverage of the 95 % intervals':50s} {'92..97 %':>8s} {sum(inside):4d}/{len(inside):<4d} "
            f"{100 * sum(inside) / len(inside):6.1f}%  {100 * low:5.1f} .. {100 * high:5.1f}"
        )
    times = sorted(o.seconds for o in rows if o.truth.case.protocol == "full")
    if times:
        lines.append(
            f"{'time of a record on the full protocol, s':50s} {'':>8s}  median {_at(times, 0.5):.1f}, "
            f"90 % {_at(times, 0.9):.1f}, longest {times[-1]:.1f}"
        )
    return "\n".join(lines)


def by_effect(rows: Rows) -> str:
    """Table of single effects under the full protocol, with the coverage of their intervals."""
    lines = [
        f"{'single effect, full protocol, >= 3 sigma':40s} {'n':>4s} {'exact':>6s} {'within':>7s} {'silent':>7s} "
        f"{'wrong':>6s} {'covered':>9s}"
    ]
    some = [
        o
        for o in rows
        if len(o.truth.effects) == 1 and not o.truth.outside and o.truth.case.protocol == "full" and o.weakest >= 2.9
    ]
    for name in sorted({o.truth.effects[0] for o in some}):
        own = [o for o in some if o.truth.effects[0] == name]
        silent = sum(o.verdict in ("none", "insufficient", "unknown") for o in own)
        inside = [c for o in own for c in o.covered.values()]
        lines.append(
            f"{name:40s} {len(own):4d} {sum(o.exact for o in own):6d} {sum(o.within for o in own):7d} "
            f"{silent:7d} {sum(o.wrong for o in own):6d} {sum(inside):4d}/{len(inside):<4d}"
        )
    return "\n".join(lines)


def confusions(rows: Rows, limit: int = 60) -> str:
    """Verdicts other than the truth, most frequent first, with numbers of the cases."""
    wanted = [
        o
        for o in rows
        if not o.exact and o.truth.case.category != "floor" and not (o.truth.outside and _detected(o) and not o.wrong)
    ]
    groups = Counter(_confusion(o) for o in wanted)
    lines = ["truth -> diagnosis (cases)"]
    for text, count in groups.most_common(limit):
        numbers = [str(o.truth.case.number) for o in wanted if _confusion(o) == text]
        lines.append(f"{count:4d}  {text} ({', '.join(numbers[:12])}{', ...' if len(numbers) > 12 else ''})")
    return "\n".join(lines)


def _confusion(o: Outcome) -> str:
    hidden = " + ".join((*o.truth.effects, *(f"[{kind}]" for kind in o.truth.outside))) or "nothing"
    where = "" if o.truth.case.protocol == "full" else f" on {o.truth.case.protocol}"
    return f"{o.truth.case.category}: {hidden}{where} -> {o.verdict} {' + '.join(o.named)}{o.error}"


def _at(values: list[float], share: float) -> float:
    return values[min(len(values) - 1, int(share * len(values)))]
