"""What a diagnosis says: names, sizes with intervals, gaps, alternatives and what to measure next."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

SCHEMA = 1
VERDICTS = ("named", "partly", "ambiguous", "none", "unknown", "insufficient")


@dataclass(frozen=True)
class Value:
    """One fitted parameter with its 95 % interval; warning: "" or what is wrong with it."""

    value: float
    low: float
    high: float
    unit: str
    warning: str = ""


@dataclass(frozen=True)
class NamedEffect:
    """One effect found; share: of the systematic gap, that it removes."""

    name: str
    parameters: dict[str, Value]
    share: float


@dataclass(frozen=True)
class Location:
    """Where the gap lies: coordinate, region in words, share of the systematic gap explained by it."""

    coordinate: str
    region: str
    share: float


@dataclass(frozen=True)
class Gap:
    """RMS between model and record, N.m, without and with the effects; noise: of the record; after_own_scatter: what
    is left of `after` without what this one drive's tolerances likely make, where a drawing states them.
    """

    before: float
    after: float
    noise: float
    held_out_before: float | None = None
    held_out_after: float | None = None
    unit: str = "N.m"
    after_own_scatter: float | None = None


@dataclass(frozen=True)
class Diagnosis:
    """The verdict on one record. alternatives: other sets that explain it as well, where the verdict is ambiguous; else
    sets that the drive's own tolerances may hide. where: of the gap before; remainder: of what is left, N.m rms, and
    its place; not_candidates: effects that this record cannot show, with the reason; notes: what else a reader should
    know.
    """

    verdict: str
    sentence: str
    effects: tuple[NamedEffect, ...]
    alternatives: tuple[tuple[str, ...], ...]
    where: tuple[Location, ...]
    gap: Gap
    next_experiment: tuple[str, ...]
    remainder: float = 0.0
    remainder_where: tuple[Location, ...] = ()
    not_candidates: dict[str, str] = field(default_factory=dict)
    indistinguishable: tuple[tuple[str, str, str], ...] = ()
    notes: tuple[str, ...] = ()
    base: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        effects = [
            {
                "name": e.name,
                "share": _round(e.share),
                "parameters": {
                    name: {k: v for k, v in asdict(p).items() if k != "warning" or v}
                    for name, p in e.parameters.items()
                },
            }
            for e in self.effects
        ]
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "effects": effects,
            "alternatives": [list(a) for a in self.alternatives],
            "where": [_place(p) for p in self.where],
            "gap": asdict(self.gap),
            "next_experiment": list(self.next_experiment),
            "remainder": {"unit": "N.m", "rms": self.remainder, "where": [_place(p) for p in self.remainder_where]},
            "not_candidates": self.not_candidates,
            "twins": [list(t) for t in self.indistinguishable],
            "notes": list(self.notes),
            "base": self.base,
            "seconds": round(self.seconds, 2),
        }

    def to_json(self) -> str:
        """The text of diagnosis.json."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"


def _place(place: Location) -> dict[str, Any]:
    return {"coordinate": place.coordinate, "region": place.region, "share": _round(place.share)}


def _round(share: float) -> float:
    return round(float(share), 4)
