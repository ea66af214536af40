"""The whole diagnosis of one record: audit, noise, scatter, isolability, search, acceptance, verdict."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from ..effects import find_effect, separating_test
from ..model.contacts.tables import cached_lookup
from ..record import Record
from .analysis import Analysis
from .estimation.held_out import fits_without_held_out, is_refuted
from .estimation.intervals import named_effect
from .estimation.problem import Problem, block_variances, make_weights, search_blocks, select_candidates
from .estimation.residuals import predicted_scatter
from .estimation.search import Search, base_fit, linearise_candidates, search
from .estimation.worker_pool import open_pool
from .forward.base_curve import BaseCurve, curve_base, drawing_base, power_base
from .inference.isolability import Isolability, isolability, separating_experiments
from .inference.mean_drive import is_mean_drive
from .inference.thresholds import calibrate_thresholds
from .inference.verdict import Conclusion, decide, unconfirmed_conclusion
from .preprocessing.audit import Audit, audit, ratio_from_angles
from .preprocessing.noise import Noise, estimate_noise
from .preprocessing.trace import Trace, make_trace
from .random_effects.element_motion import element_motion
from .random_effects.individuals import simulate_individuals
from .random_effects.responses import element_responses
from .random_effects.scatter import Scatter
from .report.gap import measure_gap
from .report.location import locate_gap
from .report.play import as_rotational_play
from .schema import Diagnosis, Gap, Location

Progress = Callable[[str, float], None]

MAX_EFFECTS = 3


def base_curve_of(drive: Drive | None, curve: str | os.PathLike[str] | None, trace: Trace) -> BaseCurve:
    """The base curve that was asked for; a free power law if none was."""
    if drive is not None:
        return drawing_base(drive, cached_lookup(drive))
    return curve_base(curve, trace.ratio) if curve is not None else power_base(trace)


def analyse(
    record: Record,
    drive: Drive | None = None,
    curve: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    base_of: Callable[[Trace], BaseCurve] | None = None,
    executor: Executor | None = None,
) -> Analysis | Diagnosis:
    """Diagnose one record; a `Diagnosis` alone where the record allows nothing."""
    started = time.perf_counter()
    say = progress or (lambda what, share: None)
    ratio = drive.ratio if drive is not None else ratio_from_angles(record)
    look = audit(record, ratio)
    if look.defects:
        return insufficient(look, look.defects, time.perf_counter() - started)
    say("base curve", 0.0)
    trace = make_trace(record, ratio)
    base = base_curve_of(drive, curve, trace) if base_of is None else base_of(trace)
    problem, fresh = prepare_problem(record, trace, base)
    reach = float(np.ptp(np.quantile(problem.torque, [0.005, 0.995])))
    if problem.noise.torque > 0.15 * reach:
        drowned = f"the noise, {problem.noise.torque:.3g} N.m, drowns a torque that spans {reach:.3g} N.m"
        return insufficient(look, [drowned], time.perf_counter() - started)
    first = base_fit(problem)
    say("isolability", 0.1)
    with open_pool(problem, executor) as pool:
        traces = linearise_candidates(pool, first)
        isolated = isolability(problem, first, traces)
        problem = replace(problem, candidates=tuple(n for n in problem.candidates if n not in isolated.invisible))
        say("thresholds", 0.2)
        thresholds = calibrate_thresholds(problem, first, fresh, traces)
        problem = replace(problem, null_excess=thresholds.null_excess)
        found = search(
            replace(pool, problem=problem), first, traces, MAX_EFFECTS, lambda what, share: say(what, 0.3 + 0.6 * share)
        )
    problem, conclusion = decide(problem, found, thresholds, isolated.indistinguishable)
    say("result", 0.95)
    held = fits_without_held_out(problem, (found.base, conclusion.chosen)) if conclusion.chosen.names else []
    if held and is_refuted(problem, found.base, conclusion.chosen, held):
        conclusion, held = unconfirmed_conclusion(problem, found.base, conclusion), []
    gap = measure_gap(problem, found.base, conclusion.chosen, held)
    diagnosis = _diagnosis(problem, found, conclusion, isolated, look, gap, time.perf_counter() - started)
    return Analysis(record, problem, found, thresholds, conclusion, isolated, diagnosis)


def prepare_problem(record: Record, trace: Trace, base: BaseCurve) -> tuple[Problem, Array]:
    """Noise, weights and candidates; and individuals (m, n) for the thresholds."""
    slope = _slope(trace, base)
    noise = estimate_noise(trace, slope)
    blocks = search_blocks(trace)
    variance, block_variance = block_variances(noise, blocks.mean(slope), blocks.count)
    n = len(variance)
    scatter, fresh = None, np.zeros((0, n))
    if base.drive is not None:
        scatter = Scatter(
            base.drive,
            element_responses(base.drive),
            element_motion(base.drive, trace, blocks),
            blocks.mean(trace.twist) - _zero(trace, base),
        )
        fresh = simulate_individuals(scatter)
    names, left_out = select_candidates(record.missing, base)
    weights = make_weights(variance, scatter, variance if scatter is None else scatter.twist)
    problem = Problem(
        base, trace, blocks, noise, weights, variance, block_variance, names, left_out, scatter, individuals=fresh
    )
    if is_mean_drive(problem, fresh):
        # Nothing may then be put down to scatter, and no individual need calibrate thresholds.
        return replace(problem, is_mean_drive=True, weights=weights.for_mean_drive()), fresh[:0]
    return problem, fresh


def _slope(trace: Trace, base: BaseCurve) -> Array:
    """Stiffness, N.m/rad, of the base curve along the record, with a first guess of its parameters."""
    twist = trace.twist
    if base.kind == "power law":
        centred = twist - np.median(twist)
        return base.elastic.evaluate(centred, 0.0, base.shape.start)[1]
    return base.elastic.evaluate(twist - _zero(trace, base), 0.0, base.shape.start)[1]


def _zero(trace: Trace, base: BaseCurve) -> float:
    """A first guess of the twist's zero: its middle where hardly any torque is carried."""
    near = np.abs(trace.torque) < 0.05 * base.full_torque
    return float((trace.twist[near].min() + trace.twist[near].max()) / 2) if near.any() else 0.0


def insufficient(look: Audit, problems: list[str] | tuple[str, ...], seconds: float) -> Diagnosis:
    """The verdict on a record that allows none."""
    return Diagnosis(
        "insufficient",
        "This record allows no diagnosis: " + "; ".join(problems) + ".",
        (),
        (),
        (),
        Gap(0.0, 0.0, 0.0),
        tuple(f"a record without this: {p}" for p in problems),
        notes=look.notes,
        seconds=seconds,
    )


def _diagnosis(
    problem: Problem,
    found: Search,
    conclusion: Conclusion,
    isolated: Isolability,
    look: Audit,
    gap: Gap,
    seconds: float,
) -> Diagnosis:
    chosen, base = conclusion.chosen, found.base
    before = problem.torque - base.prediction.torque
    noise_only = float(np.sqrt(np.mean(problem.block_variance)))
    systematic = max(float(np.mean(before**2)) - noise_only**2, 0.0)
    effects = tuple(
        as_rotational_play(named_effect(problem, chosen, name, base), problem.base) for name in chosen.names
    )
    rest = problem.torque - chosen.prediction.torque
    rest = rest - predicted_scatter(problem, chosen, rest)
    places = locate_gap(problem, rest, conclusion.remainder**2) if conclusion.remainder > 0 else ()
    sets = [list(chosen.names), *conclusion.alternatives]
    nexts = separating_experiments(sets) if conclusion.verdict == "ambiguous" else []
    if conclusion.alternatives and conclusion.verdict != "ambiguous":
        hidden = dict.fromkeys(n for names in conclusion.alternatives for n in names if n not in chosen.names)
        nexts.append(
            f"{' or '.join(hidden)}, or this drive's own tolerances: the same test on a second drive of the "
            "drawing (an effect of the kind comes again, tolerances do not)"
        )
    if conclusion.unnamed is not None:
        rms = float(np.sqrt(np.mean(conclusion.unnamed.torque**2)))
        places = (
            Location(
                conclusion.unnamed.term.coordinate,
                f"as a smooth function, {rms:.3g} N.m rms",
                min(1.0, rms**2 / max(conclusion.remainder**2, rms**2, 1e-300)),
            ),
            *places,
        )
    if conclusion.verdict in ("partly", "unknown") and places:
        nexts.append(
            f"the remainder lies in {places[0].coordinate} ({places[0].region}): repeat the record there, finer"
        )
    invisible = {**problem.excluded, **isolated.invisible}
    if conclusion.curve:
        nexts.append("tolerances or a law that bends otherwise: the same test on a second drive of the drawing")
    if conclusion.verdict == "none":
        nexts += [f"to see {name}: {find_effect(name).experiment}" for name in list(invisible)[:4]]
    own = set(chosen.names)
    nexts += [f"{a} or {b}: {separating_test(a, b)}" for a, b in isolated.indistinguishable if own & {a, b}][:3]
    notes = list(look.notes)
    if not problem.noise.repeated:
        notes.append("no cycles repeat: the noise is taken from smoothness alone and may be too small or too large")
    fitted = chosen.parameters[problem.layout(chosen.names).shape].tolist()
    shape = dict(zip(problem.base.shape.names, fitted, strict=True))
    return Diagnosis(
        conclusion.verdict,
        sentence(conclusion, gap, problem),
        effects,
        conclusion.alternatives,
        locate_gap(problem, before, systematic),
        gap,
        tuple(dict.fromkeys(nexts)),
        conclusion.remainder,
        places,
        invisible,
        tuple((a, b, separating_test(a, b)) for a, b in isolated.indistinguishable),
        tuple(notes),
        {
            "kind": problem.base.kind,
            "source": problem.base.source,
            "zero [rad]": float(chosen.parameters[0]),
            **shape,
            "scatter_size": chosen.weighting.size if len(chosen.weighting.eigenvalues) else 0.0,
            "full_torque [N.m]": problem.base.full_torque,
        },
        seconds,
    )


def sentence(conclusion: Conclusion, gap: Gap, problem: Problem) -> str:
    """The verdict in one sentence."""
    names = " and ".join(find_effect(n).title.lower() + f" ({n})" for n in conclusion.chosen.names)
    verb = "shrinks" if gap.after < gap.before else "goes"
    shrink = f"the gap {verb} from {gap.before:.3g} to {gap.after:.3g} N.m at a noise of {gap.noise:.3g} N.m"
    full = problem.base.full_torque
    place = "" if conclusion.unnamed is None else f"; it goes with {conclusion.unnamed.term.coordinate}"
    match conclusion.verdict:
        case "named":
            return f"What is missing is {names}: {shrink}{_may_hide(conclusion)}."
        case "partly":
            return (
                f"What is missing is {names}: {shrink}; a remainder of {conclusion.remainder:.3g} N.m "
                f"({100 * conclusion.remainder / full:.2g} % of full torque) that no known effect explains "
                f"is left{place}{_may_hide(conclusion)}."
            )
        case "ambiguous":
            others = "; or ".join(" and ".join(a) for a in conclusion.alternatives)
            return f"This record cannot tell: {names} fits ({shrink}), and so does {others}."
        case "unknown":
            names = " or ".join(_beside(conclusion))
            together = f" alone; {names} and this drive's own tolerances together may" if names else ""
            return (
                f"Something is missing that is not known here: a gap of {conclusion.remainder:.3g} N.m "
                f"({100 * conclusion.remainder / full:.2g} % of full torque) is beyond noise and tolerance scatter, "
                f"and no known effect explains it{together or place}."
            )
        case _:
            pass
    return f"Nothing is missing: noise and tolerance scatter explain the record{_may_hide(conclusion)}."


def _may_hide(conclusion: Conclusion) -> str:
    """What is put down to tolerances, and what could be there as well if this drive scatters less than it may."""
    more = _beside(conclusion)
    off = (
        f"; the curve is off by {conclusion.curve:.3g} N.m, as drives of the drawing may be" if conclusion.curve else ""
    )
    return off + (f"; its tolerances may hide {' or '.join(more)}" if more else "")


def _beside(conclusion: Conclusion) -> list[str]:
    """What the alternatives have beside the names that are chosen."""
    return [" and ".join(sorted(set(names) - set(conclusion.chosen.names))) for names in conclusion.alternatives]


__all__ = ["Noise", "analyse"]
