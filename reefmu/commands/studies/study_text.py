"""The results of a design study in words and tables."""

from __future__ import annotations

import numpy as np

from stiffness_model.explore.definition.metrics import METRICS
from stiffness_model.explore.evaluation.evaluate import Outcome
from stiffness_model.explore.report.chosen_drawing import rule_text
from stiffness_model.explore.report.main_effects import parameter_effect, sampled_designs
from stiffness_model.explore.report.results import Results

from ..terminal.text_table import aligned_table

ROWS = 12
"""Most members of the front in the printed table, chosen by judgement; the file has all of them."""


def study_text(results: Results) -> str:
    """Counts of designs, the Pareto front, the main effects and the chosen design."""
    paragraphs = [_summary(results)]
    if len(results.front):
        count = min(ROWS, len(results.front))
        paragraphs += [f"Pareto front, {count} of {len(results.front)} members:", _front(results)]
    paragraphs += ["share of the sample's variance that a parameter makes alone:", _main_effects(results)]
    if results.chosen is None:
        paragraphs.append(f"no design is {rule_text(results)}: no drawing is chosen")
    else:
        paragraphs += [f"chosen, {rule_text(results)}:", _chosen(results)]
    return "\n\n".join(paragraphs)


def _summary(results: Results) -> str:
    counts = np.bincount(results.evaluations.outcome, minlength=len(Outcome))
    numbers = results.study.numbers
    lines = [
        f"{results.study.name}: {len(results.evaluations)} designs, {numbers.drives} virtual drives at "
        f"{numbers.twists} twists each, seed {numbers.seed}"
    ]
    lines += [
        f"  {counts[outcome]:6d}  {words}"
        for outcome, words in (
            (Outcome.SIMULATED, "simulated"),
            (Outcome.OUT_OF_LIMITS, "left out: the drawing alone breaks a limit"),
            (Outcome.DOES_NOT_PACK, "left out: the elements do not fit"),
            (Outcome.TOO_SOFT, "do not reach the torque"),
            (Outcome.NO_DRIVE, "are no drive"),
        )
        if counts[outcome]
    ]
    lines.append(f"  {results.feasible.sum():6d}  keep within all limits, {len(results.front)} of them on the front")
    return "\n".join(lines)


def _front(results: Results) -> str:
    study = results.study
    picked = np.unique(np.linspace(0, len(results.front) - 1, ROWS).round().astype(int))
    names = list(study.objectives)
    heads = ["design", *names, *(p.name for p in study.parameters)]
    units = [
        "",
        *(f"[{METRICS[name].display_unit}]" if METRICS[name].display_unit else "" for name in names),
        *("" for _ in study.parameters),
    ]
    rows = [
        [
            str(design),
            *(f"{results.display_values(name)[design]:.4g}" for name in names),
            *_values(results, int(design)),
        ]
        for design in results.front[picked]
    ]
    return aligned_table(heads, units, rows)


def _values(results: Results, design: int) -> list[str]:
    return [
        p.text(float(x)) for p, x in zip(results.study.parameters, results.evaluations.positions[design], strict=True)
    ]


def _main_effects(results: Results) -> str:
    if not len(sampled_designs(results)):
        return "  nothing was simulated"
    names = list(results.study.objectives)
    rows = [
        [p.name, *(f"{100 * parameter_effect(results, k, name).index:.0f} %" for name in names)]
        for k, p in enumerate(results.study.parameters)
    ]
    return aligned_table(["", *names], ["", *("" for _ in names)], rows)


def _chosen(results: Results) -> str:
    design = results.chosen
    assert design is not None
    lines = [
        f"  {p.name:18s} {text}{'' if p.is_interior(float(x)) else '   (at the end of its range)'}"
        for p, text, x in zip(
            results.study.parameters, _values(results, design), results.evaluations.positions[design], strict=True
        )
    ]
    lines += [
        f"  {metric.text:30s} {results.display_values(name)[design]:10.4g} {metric.display_unit}".rstrip()
        for name, metric in METRICS.items()
        if not np.isnan(results.display_values(name)[design])
    ]
    return "\n".join(lines)
