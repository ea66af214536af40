"""The diagnosis from evidence and conclusion: sizes with intervals, locations, next experiments, notes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...effects import find_effect, separating_test
from ..amplitude_agreement import compare_amplitudes
from ..analysis import WrittenFits
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import predicted_scatter
from ..forward.parameter_layout import DELAY, ZERO
from ..inference.evidence import Evidence
from ..inference.isolability import Isolability, separating_experiments, separating_line
from ..inference.unnamed import varies_with_something
from ..preprocessing.audit import Audit
from ..probabilities.assessment import Assessment
from ..probabilities.decision import Conclusion
from ..probabilities.named_effects import named_effects
from ..random_effects.scatter import Scatter
from ..schema import Diagnosis, Gap, Location
from .bounds import parameters_at_bounds
from .location import locate_gap
from .play import as_rotational_play
from .summary import summarise

REPEAT = (
    "the remainder varies with nothing that the record holds: repeat a run unchanged, to see whether the remainder "
    "repeats, and record what else changes"
)
"""The test for something unnamed that shows in no coordinate."""
MAX_NOISE_SHARE = 0.15
"""Noise over the range of the torque above which a record allows no diagnosis; chosen by judgement."""
MAX_PROPOSED = 4
"""Experiments for effects that a record cannot show, proposed at most, for a reader's sake."""
MAX_PAIRS = 3
"""Experiments for pairs that a record cannot tell apart, proposed at most, for a reader's sake."""


def notes_on_measurement(problem: Problem) -> list[str]:
    """What the reader should know of how a record was measured: its cycles, and a filter of its channels."""
    notes: list[str] = []
    if problem.cycle_scatter is not None:
        notes.append(
            "cycles repeat in torque, not in time: at equal twist they differ by "
            f"{problem.cycle_scatter.rms:.3g} N.m, beside {problem.noise.torque:.3g} N.m of noise from sample to "
            "sample; both are in the noise that is stated, and intervals count what cycles differ by, not what other "
            "positions of the gear differ by"
        )
    elif not problem.noise.repeated:
        notes.append("no cycle repeats: the noise is estimated from smoothness alone and may be too small or too large")
    if isinstance(problem.scatter, Scatter) and (time_constant := problem.scatter.time_constant) > 0:
        notes.append(
            "torque and angles look as if all had passed one low-pass filter with a time constant of "
            f"{1e3 * time_constant:.2g} ms (a bandwidth of {1 / (2 * np.pi * time_constant):.3g} Hz): elements are "
            "taken to stand where they were before it"
        )
    return notes


def notes_on_friction(problem: Problem, chosen: Fit) -> list[str]:
    """What the reader should know of the friction of a fit: whether it is built up when runs start."""
    notes: list[str] = []
    for path, shares in problem.trace.friction.items():
        names = [name for name in chosen.names if path in find_effect(name).friction_paths]
        if names:
            low, high = (f"{100 * share:.0f} %" for share in (shares.min(), shares.max()))
            notes.append(
                f"the friction ({', '.join(names)}) looks built up when runs start, to between {low} and {high} of its "
                "torque; model.toml starts without. To avoid this, start every run from rest, after the drive has been "
                "unloaded"
            )
    return notes


def assemble_diagnosis(
    evidence: Evidence, isolated: Isolability, found: Assessment, written: WrittenFits, gap: Gap, audited: Audit
) -> Diagnosis:
    """The diagnosis as it is written to diagnosis.json; its `seconds` are set by the caller."""
    problem, base, conclusion = evidence.problem, evidence.search.base, found.conclusion
    chosen = conclusion.chosen
    named = named_effects(problem, chosen, base, found.rivals)
    effects = tuple(as_rotational_play(effect, problem.base) for effect in named)
    before = problem.torque - written.base.prediction.torque
    systematic = max(float(np.mean(before**2) - np.mean(problem.block_variance)), 0.0)
    remainder_where = _locate_remainder(problem, conclusion)
    not_candidates = {**problem.excluded, **isolated.invisible}
    return Diagnosis(
        conclusion.verdict,
        summarise(conclusion, gap, problem.base.full_torque),
        effects,
        conclusion.alternatives,
        locate_gap(problem, before, systematic),
        gap,
        _next_experiments(isolated, conclusion, remainder_where, not_candidates),
        conclusion.remainder,
        remainder_where,
        not_candidates,
        tuple((a, b, separating_test(a, b)) for a, b in isolated.indistinguishable),
        (*audited.notes, *notes_on_measurement(problem), *notes_on_friction(problem, chosen)),
        _base_parameters(problem, written.corrected),
        parameters_at_bounds(problem, chosen),
        compare_amplitudes(problem, chosen),
        shown_alternatives=conclusion.shown_alternatives,
    )


def noise_refusal(problem: Problem) -> str:
    """Why the record is too noisy; empty if it is not."""
    span = float(np.ptp(np.quantile(problem.torque, [0.005, 0.995])))
    if problem.noise.torque <= MAX_NOISE_SHARE * span:
        return ""
    return f"the noise, {problem.noise.torque:.3g} N.m, is too large for a torque that spans {span:.3g} N.m"


def base_refusal(problem: Problem, chosen: Fit, gap: Gap) -> str:
    """Why the base curve is not that of this record's gear; empty where it may be.

    The mean of the record predicts its torque with an error of the torque's standard deviation. A model that predicts
    it worse than this constant (a negative coefficient of determination) says nothing about the drive. A base curve
    alone may do so where effects explain the rest, but not where they need a size at a bound, beyond that of any gear.
    """
    base, spread = problem.base, float(np.std(problem.trace.torque))
    if gap.before < spread and gap.after < spread:
        return ""
    if gap.after < spread and not parameters_at_bounds(problem, chosen):
        return ""
    beside = f", and {gap.after:.3g} N.m with the effects that fit best" if chosen.names else ""
    return (
        f"the {base.kind} {base.source} predicts the torque worse than the record's mean does (gap {gap.before:.3g} "
        f"N.m{beside}; standard deviation of the torque {spread:.3g} N.m): it is not of this gear, or a unit or the "
        "ratio is wrong; no corrected model is written"
    )


def insufficient_diagnosis(audited: Audit, defects: Sequence[str], gap: Gap | None = None) -> Diagnosis:
    """The diagnosis of a record whose defects allow none; gap: where one was measured."""
    return Diagnosis(
        "insufficient",
        "This record allows no diagnosis: " + "; ".join(defects) + ".",
        (),
        (),
        (),
        gap or Gap(0.0, 0.0, 0.0),
        tuple(f"the record with this mended: {defect}" for defect in defects),
        notes=audited.notes,
    )


def _locate_remainder(problem: Problem, conclusion: Conclusion) -> tuple[Location, ...]:
    """Where the remainder lies, the coordinate of its nonparametric term first."""
    chosen, unnamed = conclusion.chosen, conclusion.unnamed
    rest = problem.torque - chosen.prediction.torque
    rest = rest - predicted_scatter(problem, chosen, rest)
    locations = locate_gap(problem, rest, conclusion.remainder**2) if conclusion.remainder > 0 else ()
    if unnamed is None or not varies_with_something(unnamed):
        return locations
    share = min(1.0, unnamed.rms**2 / max(conclusion.remainder**2, unnamed.rms**2, 1e-300))
    smooth = Location(unnamed.term.coordinate, f"as a smooth function, {unnamed.rms:.3g} N.m rms", share)
    return (smooth, *locations)


def _next_experiments(
    isolated: Isolability,
    conclusion: Conclusion,
    remainder_where: Sequence[Location],
    not_candidates: dict[str, str],
) -> tuple[str, ...]:
    """What to measure next, the most useful first."""
    names = conclusion.chosen.names
    found: list[str] = []
    if conclusion.verdict == "ambiguous":
        found += separating_experiments([names, *conclusion.shown_alternatives])
    if conclusion.unnamed and not varies_with_something(conclusion.unnamed):
        found.append(REPEAT)
    elif conclusion.verdict in ("partly", "unknown") and remainder_where:
        first = remainder_where[0]
        found.append(
            f"the remainder varies with {first.coordinate} ({first.region}): repeat the test there in finer steps"
        )
    if conclusion.curve_deviation:
        found.append("modulus or tolerance: the same test on a second drive of the drawing")
    if conclusion.verdict == "none":
        found += [f"to show {name}: {find_effect(name).experiment}" for name in list(not_candidates)[:MAX_PROPOSED]]
    pairs = [(a, b) for a, b in isolated.indistinguishable if {a, b} & set(names)]
    found += [separating_line(a, b) for a, b in pairs[:MAX_PAIRS]]
    return tuple(dict.fromkeys(found))


def _base_parameters(problem: Problem, chosen: Fit) -> dict[str, Any]:
    """The base curve and its parameters in the corrected model."""
    fitted = chosen.parameters[problem.layout(chosen.names).shape].tolist()
    return {
        "kind": problem.base.kind,
        "source": problem.base.source,
        "zero [rad]": float(chosen.parameters[ZERO]),
        "delay [s]": float(chosen.parameters[DELAY]),
        **dict(zip(problem.base.shape.names, fitted, strict=True)),
        "scatter_size": chosen.weighting.size if len(chosen.weighting.eigenvalues) else 0.0,
        "full_torque [N.m]": problem.base.full_torque,
    }
