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
from ..model.tables import cached_lookup
from ..record import Record
from .analysis import Analysis
from .estimation.held_out import held_fits, spoken_against
from .estimation.intervals import named_effect
from .estimation.problem import Study, block_variances, candidates_of, make_weights, search_blocks
from .estimation.remainder import scattered
from .estimation.search import Search, base_fit, search, traces_of
from .estimation.worker_pool import crew_of
from .forward.base_curve import Base, curve_base, drawing_base, power_base, ratio_without_drawing
from .forward.effect_functions import kernel
from .inference.isolability import Isolability, isolability, separating_experiments
from .inference.mean_drive import is_mean_drive
from .inference.thresholds import calibrate_thresholds
from .inference.verdict import Conclusion, decide, unconfirmed_conclusion
from .preprocessing.audit import Audit, audit
from .preprocessing.noise import Noise, estimate_noise
from .preprocessing.trace import Trace, trace_of
from .random_effects.individuals import individuals_along
from .random_effects.responses import element_responses
from .random_effects.scatter import Scatter, turning
from .report.gap import measure_gap
from .report.location import locate_gap
from .report.play import as_rotational_play
from .schema import Diagnosis, Gap, Location

Progress = Callable[[str, float], None]

MAX_EFFECTS = 3


def base_curve_of(drive: Drive | None, curve: str | os.PathLike[str] | None, trace: Trace) -> Base:
    """The base curve that was asked for; a free power law if none was."""
    if drive is not None:
        return drawing_base(drive, cached_lookup(drive))
    return curve_base(curve, trace.ratio) if curve is not None else power_base(trace)


def analyse(
    record: Record,
    drive: Drive | None = None,
    curve: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    base_of: Callable[[Trace], Base] | None = None,
    executor: Executor | None = None,
) -> Analysis | Diagnosis:
    """Diagnose one record; a `Diagnosis` alone where the record allows nothing."""
    started = time.perf_counter()
    say = progress or (lambda what, share: None)
    ratio = drive.ratio if drive is not None else ratio_without_drawing(record)
    look = audit(record, ratio)
    if look.problems:
        return insufficient(look, look.problems, time.perf_counter() - started)
    say("base curve", 0.0)
    trace = trace_of(record, ratio)
    base = base_curve_of(drive, curve, trace) if base_of is None else base_of(trace)
    study, fresh = prepare_problem(record, trace, base)
    reach = float(np.ptp(np.quantile(study.torque, [0.005, 0.995])))
    if study.noise.torque > 0.15 * reach:
        drowned = f"the noise, {study.noise.torque:.3g} N.m, drowns a torque that spans {reach:.3g} N.m"
        return insufficient(look, [drowned], time.perf_counter() - started)
    first = base_fit(study)
    say("isolability", 0.1)
    with crew_of(study, executor) as crew:
        traces = traces_of(crew, first)
        isolated = isolability(study, first, traces)
        study = replace(study, candidates=tuple(n for n in study.candidates if n not in isolated.invisible))
        say("thresholds", 0.2)
        thresholds = calibrate_thresholds(study, first, fresh, traces)
        study = replace(study, null_excess=thresholds.null_excess)
        found = search(
            replace(crew, study=study), first, traces, MAX_EFFECTS, lambda what, share: say(what, 0.3 + 0.6 * share)
        )
    study, conclusion = decide(study, found, thresholds, isolated.indistinguishable)
    say("result", 0.95)
    held = held_fits(study, (found.base, conclusion.chosen)) if conclusion.chosen.names else []
    if held and spoken_against(study, found.base, conclusion.chosen, held):
        conclusion, held = unconfirmed_conclusion(study, found.base, conclusion), []
    gap = measure_gap(study, found.base, conclusion.chosen, held)
    diagnosis = _diagnosis(study, found, conclusion, isolated, look, gap, time.perf_counter() - started)
    return Analysis(record, study, found, thresholds, conclusion, isolated, diagnosis)


def prepare_problem(record: Record, trace: Trace, base: Base) -> tuple[Study, Array]:
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
            turning(base.drive, trace, blocks),
            blocks.mean(trace.twist) - _zero(trace, base),
        )
        fresh = individuals_along(scatter)
    names, left_out = candidates_of(record.missing, base)
    weights = make_weights(variance, scatter, variance if scatter is None else scatter.twist)
    study = Study(
        base, trace, blocks, noise, weights, variance, block_variance, names, left_out, scatter, individuals=fresh
    )
    if is_mean_drive(study, fresh):
        # Nothing may then be put down to scatter, and no individual need calibrate thresholds.
        return replace(study, mean=True, weights=weights.of_the_mean()), fresh[:0]
    return study, fresh


def _slope(trace: Trace, base: Base) -> Array:
    """Stiffness, N.m/rad, of the base curve along the record, with a first guess of its parameters."""
    twist = trace.twist
    if base.kind == "power law":
        centred = twist - np.median(twist)
        return base.elastic.evaluate(centred, 0.0, base.shape_start)[1]
    return base.elastic.evaluate(twist - _zero(trace, base), 0.0, base.shape_start)[1]


def _zero(trace: Trace, base: Base) -> float:
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
    study: Study, found: Search, conclusion: Conclusion, isolated: Isolability, look: Audit, gap: Gap, seconds: float
) -> Diagnosis:
    chosen, base = conclusion.chosen, found.base
    before = study.torque - base.prediction.torque
    noise_only = float(np.sqrt(np.mean(study.block_variance)))
    systematic = max(float(np.mean(before**2)) - noise_only**2, 0.0)
    effects = tuple(as_rotational_play(named_effect(study, chosen, name, base), study.base) for name in chosen.names)
    rest = study.torque - chosen.prediction.torque
    rest = rest - scattered(study, chosen, rest)
    places = locate_gap(study, rest, conclusion.remainder**2) if conclusion.remainder > 0 else ()
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
    invisible = {**study.left_out, **isolated.invisible}
    if conclusion.curve:
        nexts.append("tolerances or a law that bends otherwise: the same test on a second drive of the drawing")
    if conclusion.verdict == "none":
        nexts += [f"to see {name}: {find_effect(name).experiment}" for name in list(invisible)[:4]]
    own = set(chosen.names)
    nexts += [f"{a} or {b}: {separating_test(a, b)}" for a, b in isolated.indistinguishable if own & {a, b}][:3]
    notes = list(look.notes)
    if not study.noise.repeated:
        notes.append("no cycles repeat: the noise is taken from smoothness alone and may be too small or too large")
    fitted = chosen.parameters[study.layout(chosen.names).shape].tolist()
    shape = dict(zip(study.base.shape_names, fitted, strict=True))
    return Diagnosis(
        conclusion.verdict,
        sentence(conclusion, gap, study),
        effects,
        conclusion.alternatives,
        locate_gap(study, before, systematic),
        gap,
        tuple(dict.fromkeys(nexts)),
        conclusion.remainder,
        places,
        invisible,
        tuple((a, b, separating_test(a, b)) for a, b in isolated.indistinguishable),
        tuple(notes),
        {
            "kind": study.base.kind,
            "source": study.base.source,
            "zero [rad]": float(chosen.parameters[0]),
            **shape,
            "scatter_size": chosen.weighting.size if len(chosen.weighting.strength) else 0.0,
            "full_torque [N.m]": study.base.full_torque,
        },
        seconds,
    )


def sentence(conclusion: Conclusion, gap: Gap, study: Study) -> str:
    """The verdict in one sentence."""
    names = " and ".join(kernel(n).effect.title.lower() + f" ({n})" for n in conclusion.chosen.names)
    verb = "shrinks" if gap.after < gap.before else "goes"
    shrink = f"the gap {verb} from {gap.before:.3g} to {gap.after:.3g} N.m at a noise of {gap.noise:.3g} N.m"
    full = study.base.full_torque
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
