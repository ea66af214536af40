"""What a diagnosis says: names, sizes with intervals, gaps, alternatives and what to measure next."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from stiffness_model.display import dataframe, html_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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

    def __repr__(self) -> str:
        names = ", ".join(effect.name for effect in self.effects) or "no effect"
        return (
            f"Diagnosis({self.verdict!r}, {names}, gap {self.gap.before:.3g} -> {self.gap.after:.3g} {self.gap.unit}, "
            f"noise {self.gap.noise:.3g})"
        )

    def _repr_html_(self) -> str:
        rows = {
            "verdict": self.verdict,
            **{
                f"{effect.name}.{name} [{p.unit}]": f"{p.value:.4g} ({p.low:.4g} ... {p.high:.4g})"
                for effect in self.effects
                for name, p in effect.parameters.items()
            },
            f"gap before [{self.gap.unit}]": f"{self.gap.before:.4g}",
            f"gap after [{self.gap.unit}]": f"{self.gap.after:.4g}",
            f"noise [{self.gap.unit}]": f"{self.gap.noise:.4g}",
        }
        return html_table(self.sentence, rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """RMS gap without and with the effects beside the noise, on `ax` or on new axes, which are returned."""
        from stiffness_model.plotting.style import BLUE, FAINT, caption, format_axes, new_axes

        ax = new_axes(height=2.4) if ax is None else ax
        ax.barh(
            ["noise", "with effects", "without effects"],
            [self.gap.noise, self.gap.after, self.gap.before],
            color=[FAINT, BLUE, BLUE],
        )
        return caption(format_axes(ax, f"gap, rms [{self.gap.unit}]", ""), self.sentence)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each fitted parameter: value, 95 % interval, unit, and the share of the
        gap that its effect removes. Raises `InputError` without pandas.
        """
        rows = [(effect, name, p) for effect in self.effects for name, p in effect.parameters.items()]
        return dataframe(
            {
                "effect": [effect.name for effect, _, _ in rows],
                "parameter": [name for _, name, _ in rows],
                "value": [p.value for _, _, p in rows],
                "low": [p.low for _, _, p in rows],
                "high": [p.high for _, _, p in rows],
                "unit": [p.unit for _, _, p in rows],
                "share [1]": [effect.share for effect, _, _ in rows],
            }
        )

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
