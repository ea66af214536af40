"""A diagnosis held against the truth: what counts as right, with the meaning that the contract gives to the names.

Backlash and preload are one quantity with two signs, and the sign that fits is the name. Names that this record cannot
tell apart by the Cramer-Rao bound are one set: a diagnosis that declares them as such ("twins") has reported both. A
modulus that is off and a base curve that is off within tolerance are one record from one drive: "modulus or tolerance"
is right for either. It is said by those words in the sentence or the notes, or by an ambiguous verdict whose sets are
["modulus_error"] and [].
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.validation.blind.scoring import COVERED

from .bounds import SEPARABLE

TENTH = 0.1
"""Share of its tolerance deviation below which an effect is nothing."""
MODULUS = frozenset({"modulus_error"})
NAMING, SILENT = ("named", "partly"), ("none", "insufficient")
Reported = frozenset[str] | None
"""A set of effects; None for something that has no name."""
_UNITS = {"um": 1e-6, "µm": 1e-6, "nm": 1e-9, "mm": 1e-3, "arcmin": math.pi / 10800, "mrad": 1e-3, "%": 0.01}


@dataclass(frozen=True)
class Outcome:
    """One diagnosis judged.

    truth, answer: of the row; said: verdict with names; exact: what is hidden and nothing else, as a finding; within:
    the truth is among the reported sets; wrong: a name as a finding that is not hidden; detected: something unnamed was
    reported; alarm: anything was reported; negligible: names of effects below `TENTH` of their tolerance deviation, as
    a finding; covered: of comparable parameters, whether the interval holds the truth; hypotheses, effects:
    (probability, whether right).
    """

    truth: Mapping[str, Any]
    verdict: str
    named: frozenset[str]
    exact: bool
    within: bool
    wrong: bool
    detected: bool
    alarm: bool
    negligible: tuple[str, ...]
    covered: Mapping[str, bool]
    hypotheses: tuple[tuple[float, bool], ...]
    effects: tuple[tuple[float, bool], ...]
    global_p: float | None
    seconds: float
    processor: float
    error: str = ""

    @property
    def category(self) -> str:
        return str(self.truth["category"])

    @property
    def separable(self) -> bool:
        return bool(self.truth["separable"])

    @property
    def visible(self) -> bool:
        """Whether every hidden name differs from nothing by as much as separable ones do from each other."""
        return min(self.truth["detectable"].values(), default=0.0) >= SEPARABLE

    @property
    def over_scatter(self) -> float:
        return min(self.truth["over_scatter"].values(), default=0.0)


def judge(row: Mapping[str, Any]) -> Outcome:
    """Judge a row of results: {"truth": ..., "answer": ..., "seconds": ..., "processor": ..., "error": ...}."""
    truth, answer = row["truth"], row.get("answer") or {}
    verdict = str(answer.get("verdict", "error"))
    named = frozenset(e["name"] for e in answer.get("effects") or [])
    hidden, foreign, base = frozenset(truth["names"]), bool(truth["foreign"]), bool(truth["base_off"])
    sets = reported(answer, truth)
    tolerated = modulus_or_tolerance(answer, sets)
    detected = verdict in ("unknown", "partly") or (verdict == "ambiguous" and None in sets)
    finding = verdict in NAMING
    if foreign:
        exact = named == hidden and (verdict == "partly" if hidden else verdict == "unknown")
        within = exact or (detected and (named <= hidden or verdict == "ambiguous"))
    elif not hidden:
        exact = verdict == "none" or (base and tolerated)
        within = exact or (verdict == "ambiguous" and frozenset[str]() in sets)
    else:
        either = hidden == MODULUS and tolerated
        exact = either or (finding and named == hidden)
        within = exact or (verdict in (*NAMING, "ambiguous") and hidden in sets)
    return Outcome(
        truth,
        verdict,
        named,
        exact,
        within,
        finding and not named <= hidden and not (base and tolerated),
        detected,
        verdict not in SILENT and not (base and tolerated),
        tuple(sorted(negligible(answer, truth))) if finding else (),
        covered(answer, truth) if exact else {},
        tuple(hypotheses(answer, truth)),
        tuple(
            (float(e["probability"]), e["name"] in hidden)
            for e in answer.get("effects") or []
            if e.get("probability") is not None
        ),
        answer.get("global_p"),
        float(row["seconds"]),
        float(row["processor"]),
        str(row.get("error") or ""),
    )


def reported(answer: Mapping[str, Any], truth: Mapping[str, Any]) -> list[Reported]:
    """The sets that a diagnosis leaves open: what it names, its alternatives, and what its twins say is the same where
    the record cannot tell them apart."""
    alternatives: Sequence[Sequence[str] | None] = answer.get("alternatives") or []
    named: Reported = frozenset(e["name"] for e in answer.get("effects") or [])
    if answer.get("verdict") == "unknown" and not named:
        named = None
    sets: list[Reported] = [named, *(None if a is None else frozenset(a) for a in alternatives)]
    near = {frozenset((name, rival)) for name, rivals in truth["rivals"].items() for rival in rivals}
    for twins in answer.get("twins") or []:
        pair = frozenset(twins[:2])
        if pair in near:
            sets += [s ^ pair for s in sets if s is not None and len(s & pair) == 1]
    return sets


def modulus_or_tolerance(answer: Mapping[str, Any], sets: Sequence[Reported]) -> bool:
    """Whether a diagnosis says that a modulus or the tolerance of the base curve explains the record."""
    nothing = frozenset[str]()
    if answer.get("verdict") == "ambiguous" and set(sets) - {nothing} == {MODULUS} and nothing in sets:
        return True
    words = " ".join([str(answer.get("sentence", "")), *map(str, answer.get("notes") or [])]).lower()
    return "modulus or tolerance" in words and {n for s in sets if s is not None for n in s} <= MODULUS


def negligible(answer: Mapping[str, Any], truth: Mapping[str, Any]) -> set[str]:
    """Names that are reported though their true size, or the reported one, is below `TENTH` of a deviation."""
    found = set()
    for effect in answer.get("effects") or []:
        name = effect["name"]
        deviation = truth["deviations"].get(name)
        if deviation is None:
            continue
        sizes = truth["parameters"].get(name, {}).values()
        said = [abs(_si(p, "value")) for key, p in effect.get("parameters", {}).items() if key in COVERED.get(name, ())]
        if (sizes and max(map(abs, sizes)) < TENTH * deviation) or (said and max(said) < TENTH * deviation):
            found.add(name)
    return found


def covered(answer: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, bool]:
    """Of every parameter that means the same in generator and diagnosis, whether its 95 % interval holds the truth."""
    out = {}
    for effect in answer.get("effects") or []:
        name = effect["name"]
        for key in COVERED.get(name, ()):
            said, real = effect["parameters"].get(key), truth["parameters"].get(name, {}).get(key)
            if said is not None and real is not None:
                out[f"{name}.{key}"] = bool(_si(said, "low") <= real <= _si(said, "high"))
    return out


def _si(parameter: Mapping[str, Any], key: str) -> float:
    return float(parameter[key]) * _UNITS.get(str(parameter.get("unit", "")).split("/")[0], 1.0)


def hypotheses(answer: Mapping[str, Any], truth: Mapping[str, Any]) -> list[tuple[float, bool]]:
    """(probability, whether right) of every hypothesis. Those that no record of this kind tells from the truth are one
    hypothesis with it: the indistinguishable names, and modulus and nothing where either is true."""
    hidden = frozenset(truth["names"])
    right: set[Reported] = {None} if truth["foreign"] else {hidden}
    if not truth["foreign"]:
        for name, rivals in truth["rivals"].items():
            right |= {(hidden - {name}) | {rival} for rival in rivals}
        if truth["base_off"] or hidden == MODULUS:
            right |= {MODULUS, frozenset()}
    whole, others = 0.0, []
    for hypothesis in answer.get("hypotheses") or []:
        effects = hypothesis["effects"]
        key = None if effects is None else frozenset(effects)
        if key in right:
            whole += float(hypothesis["probability"])
        else:
            others.append((float(hypothesis["probability"]), False))
    return [(min(whole, 1.0), True), *others] if answer.get("hypotheses") else []
