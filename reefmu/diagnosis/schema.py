"""The result of a diagnosis, and the schema of diagnosis.json in which it is written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from math import nan
from textwrap import fill
from typing import TYPE_CHECKING, Any

from stiffness_model.display import dataframe, html_table

from .fitted_values import AmplitudeTest, CrankLosses, NamedEffect, ParameterAtBound
from .hypotheses import (
    PROBABILITY_DIGITS,
    Hypothesis,
    IsolabilityMatrix,
    effect_probability,
    hypothesis_text,
    likeliest,
    merged,
    probability_text,
    ranked,
    reported_hypotheses,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SCHEMA, PROBABILITY_SCHEMA = 1, 2
"""Versions of the schema without and with probabilities; a version changes with its keys and their meaning."""
VERDICTS = ("named", "partly", "ambiguous", "none", "unknown", "insufficient")
"""Every verdict that a diagnosis can have; `reefmu.diagnosis.report.text.MEANING` says what they mean."""
LABEL_WIDTH, CAPTION_WIDTH = 28, 52
"""Characters of a line of a bar's label and of the caption, which fit a figure of 6.4 inches side by side."""


@dataclass(frozen=True)
class Location:
    """Where a gap lies: the coordinate it varies with, the region in words, the share of the systematic gap that the
    coordinate explains."""

    coordinate: str
    region: str
    share: float


@dataclass(frozen=True)
class Gap:
    """Root mean square of measured less simulated torque, N.m: before and after the effects are added, over the whole
    record and over the runs that were held out of a second fit. noise: standard deviation of all that does not repeat;
    after_own_scatter: `after` without the likeliest scatter of this one drive, None where no drawing states tolerances.
    raw_before, raw_after: over the whole record with the angles as measured, whose noise the others leave out.
    """

    before: float
    after: float
    noise: float
    held_out_before: float | None = None
    held_out_after: float | None = None
    unit: str = "N.m"
    after_own_scatter: float | None = None
    raw_before: float | None = None
    raw_after: float | None = None

    @property
    def shrinks(self) -> bool:
        """Whether the model with the effects is closer to the record than the one without."""
        return self.after < self.before


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis of one record.

    verdict: one of `VERDICTS`; sentence: the verdict in words; effects: that are missing in the model. alternatives:
    the other sets of effects that the record does not exclude, those of the likeliest explanations of 98 % in total, ()
    where nothing may be missing; none where the verdict finds no effect. where: locations of the gap without effects,
    the largest share first. next_experiment: tests that would tell more. remainder: N.m rms, left beside the effects,
    and remainder_where its locations. not_candidates: effects that this record cannot show, with the reason.
    indistinguishable: pairs of effects with the test that tells them apart. notes: on the quality of the record. base:
    kind, source and parameters of the base curve. at_bounds: parameters that stopped at a bound of their range.
    amplitudes: sizes in small and large cycles. seconds: computing time. hypotheses: every explanation with its
    probability, of sum 1; empty where none were compared. global_p: p-value of the chosen model, whether it explains
    the record. isolability: which effects this record tells apart. losses: friction at the crank, of a record with the
    torques of crank and output. shown_alternatives: the alternatives of which every effect shows in the record; in the
    others one may be missing that is too small for it.
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
    at_bounds: tuple[ParameterAtBound, ...] = ()
    amplitudes: tuple[AmplitudeTest, ...] = ()
    seconds: float = 0.0
    hypotheses: tuple[Hypothesis, ...] = ()
    global_p: float | None = None
    isolability: IsolabilityMatrix | None = None
    losses: CrankLosses | None = None
    shown_alternatives: tuple[tuple[str, ...], ...] = ()

    def with_probabilities(
        self, hypotheses: Sequence[Hypothesis], global_p: float | None, isolability: IsolabilityMatrix | None
    ) -> Diagnosis:
        """The same diagnosis with probabilities; every effect gets the sum over the hypotheses that contain it."""
        effects = tuple(replace(e, probability=effect_probability(e.name, hypotheses)) for e in self.effects)
        return replace(
            self, effects=effects, hypotheses=ranked(merged(hypotheses)), global_p=global_p, isolability=isolability
        )

    @property
    def has_model(self) -> bool:
        """Whether there is a corrected model: the record allows a diagnosis, and what is named shrinks the gap."""
        return self.verdict != "insufficient" and (not self.effects or self.gap.shrinks)

    def __repr__(self) -> str:
        chance = {e.name: f" {probability_text(e.probability)}" if self.hypotheses else "" for e in self.effects}
        names = ", ".join(f"{name}{text}" for name, text in chance.items()) or "no effect"
        return (
            f"Diagnosis({self.verdict!r}, {names}, gap {self.gap.before:.3g} -> {self.gap.after:.3g} {self.gap.unit}, "
            f"noise {self.gap.noise:.3g})"
        )

    def _repr_html_(self) -> str:
        chances = {f"hypothesis: {hypothesis_text(h)}": h.probability for h in likeliest(self.hypotheses)}
        if self.hypotheses:
            chances |= {f"{effect.name} is missing": effect.probability for effect in self.effects}
        rows = {
            "verdict": self.verdict,
            **{label: probability_text(p) for label, p in chances.items()},
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
        """Probabilities of the likeliest hypotheses, or where there are none the RMS gap without and with the effects
        beside the noise, on `ax` or on new axes, which are returned."""
        from stiffness_model.plotting.style import BLUE, FAINT, caption, format_axes, new_axes

        ax = new_axes(height=3.0) if ax is None else ax
        if self.hypotheses:
            shown = likeliest(self.hypotheses)[::-1]
            labels = [fill(hypothesis_text(h), LABEL_WIDTH) for h in shown]
            bars = ax.barh(labels, [h.probability for h in shown], color=BLUE)
            ax.bar_label(bars, [probability_text(h.probability) for h in shown], padding=3, fontsize="small")
            ax.set_xlim(0, 1.15)
            ax.tick_params(axis="y", labelsize="small")
            format_axes(ax, "probability [1]", "")
        else:
            ax.barh(
                ["noise", "with effects", "without effects"],
                [self.gap.noise, self.gap.after, self.gap.before],
                color=[FAINT, BLUE, BLUE],
            )
            format_axes(ax, f"gap, rms [{self.gap.unit}]", "")
        return caption(ax, fill(self.sentence, CAPTION_WIDTH))

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each fitted parameter: value, 95 % interval, unit, and of its
        effect the share of the gap that it removes and the probability. Raises `InputError` without pandas.
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
                "probability [1]": [effect.probability if self.hypotheses else nan for effect, _, _ in rows],
            }
        )

    def to_dict(self) -> dict[str, Any]:
        """The content of diagnosis.json, by the keys of its schema: 2 with hypotheses, else 1."""
        compared = bool(self.hypotheses)
        effects = [
            {
                "name": e.name,
                "share": _round(e.share),
                **({"probability": round(float(e.probability), PROBABILITY_DIGITS)} if compared else {}),
                "parameters": {name: p.to_dict() for name, p in e.parameters.items()},
            }
            for e in self.effects
        ]
        probabilities = {
            "hypotheses": reported_hypotheses(self.hypotheses),
            "global_p": None if self.global_p is None else float(self.global_p),
            "isolability": (self.isolability or IsolabilityMatrix((), ())).to_dict(),
        }
        return {
            "schema": PROBABILITY_SCHEMA if compared else SCHEMA,
            "verdict": self.verdict,
            "sentence": self.sentence,
            **(probabilities if compared else {}),
            "effects": effects,
            "alternatives": [list(a) for a in self.alternatives],
            "shown_alternatives": [list(a) for a in self.shown_alternatives],
            "where": [_location(p) for p in self.where],
            "gap": asdict(self.gap),
            "next_experiment": list(self.next_experiment),
            "remainder": {"unit": "N.m", "rms": self.remainder, "where": [_location(p) for p in self.remainder_where]},
            "not_candidates": self.not_candidates,
            "twins": [list(t) for t in self.indistinguishable],
            "notes": list(self.notes),
            "base": self.base,
            "at_bounds": [asdict(p) for p in self.at_bounds],
            "amplitudes": [asdict(t) for t in self.amplitudes],
            **({} if self.losses is None else {"crank_friction": self.losses.to_dict()}),
            "seconds": round(self.seconds, 2),
        }

    def to_json(self) -> str:
        """The text of diagnosis.json."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"


def _location(location: Location) -> dict[str, Any]:
    return {"coordinate": location.coordinate, "region": location.region, "share": _round(location.share)}


def _round(share: float) -> float:
    return round(float(share), 4)
