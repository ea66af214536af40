"""The whole diagnosis of one record: audit, noise, scatter, isolability, search, acceptance, verdict."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drive import Drive

from ..record import Record
from ..tables import cached_lookup
from .accept import Thresholds, calibrate
from .audit import Audit, audit
from .base import Base, curve_base, drawing_base, power_base, ratio_without_drawing
from .fit import Fit
from .identify import Search, base_fit, search
from .isolate import Isolability, isolability, splitting, wanted
from .kernels import kernel
from .locate import locate
from .noise import Noise, estimate_noise
from .play import as_play
from .report_gap import gap_of
from .result import Diagnosis, Gap, NamedEffect, Value
from .scatter import Scatter, cached_maps, fresh_individuals, gear_share
from .scores import directions
from .study import Study, block_variances, candidates_of, make_weights, search_blocks
from .trace import Trace, trace_of
from .verdict import Finding, decide, scattered

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

MOST_EFFECTS = 3
PATH_NOISE = 0.15
"""Noise of a step of the twist, over its typical size, above which paths are smoothed more."""
WINDOWS = (1, 3, 5, 9, 15)


@dataclass(frozen=True)
class Examined:
    """Everything behind a diagnosis, for the report and the corrected model."""

    record: Record
    study: Study
    search: Search
    thresholds: Thresholds
    finding: Finding
    isolability: Isolability
    diagnosis: Diagnosis


def base_for(drive: Drive | None, curve: str | os.PathLike[str] | None, trace: Trace) -> Base:
    """The base curve that was asked for; a free power law if none was."""
    if drive is not None:
        return drawing_base(drive, cached_lookup(drive))
    return curve_base(curve, trace.ratio) if curve is not None else power_base(trace)


def examine(record: Record, drive: Drive | None = None, curve: str | os.PathLike[str] | None = None,
            progress: Progress | None = None, base_of: Callable[[Trace], Base] | None = None) -> Examined | Diagnosis:
    """Diagnose one record; a `Diagnosis` alone where the record allows nothing."""
    started = time.perf_counter()
    say = progress or (lambda what, share: None)
    ratio = drive.ratio if drive is not None else ratio_without_drawing(record)
    look = audit(record, ratio)
    if look.problems:
        return insufficient(look, look.problems, time.perf_counter() - started)
    say("base curve", 0.0)
    trace = smooth_trace(record, ratio)
    base = base_for(drive, curve, trace) if base_of is None else base_of(trace)
    study, fresh = prepare(record, trace, base)
    reach = float(np.ptp(np.quantile(study.torque, [0.005, 0.995])))
    if study.noise.torque > 0.15 * reach:
        drowned = f"the noise, {study.noise.torque:.3g} N.m, drowns a torque that spans {reach:.3g} N.m"
        return insufficient(look, [drowned], time.perf_counter() - started)
    first = base_fit(study)
    say("isolability", 0.1)
    traces = {name: directions(study, name, first) for name in study.candidates}
    isolated = isolability(study, first, traces)
    study.candidates = tuple(n for n in study.candidates if n not in isolated.invisible)
    say("thresholds", 0.2)
    thresholds = calibrate(study, first, fresh, traces)
    found = search(study, MOST_EFFECTS, lambda what, share: say(what, 0.3 + 0.6 * share))
    finding = decide(study, found, thresholds, isolated.twins)
    say("result", 0.95)
    diagnosis = _diagnosis(record, study, found, finding, isolated, look, time.perf_counter() - started)
    return Examined(record, study, found, thresholds, finding, isolated, diagnosis)


def smooth_trace(record: Record, ratio: float) -> Trace:
    """The trace with paths as smooth as the twist's noise asks for."""
    twist = record.twist(ratio)
    inner = np.convolve(np.diff(record.run) != 0, np.ones(3), "same") < 0.5
    third = np.diff(twist, 3)
    # Third differences of white noise have 20 times its variance; motion is smoother than that.
    noise = 1.4826 * float(np.median(np.abs(third))) / np.sqrt(20)
    step = np.abs(np.diff(twist))[inner]
    moving = step[step > 0.25 * np.quantile(step, 0.9)] if step.size else step
    typical = float(np.median(moving)) if moving.size else 0.0
    enough = [w for w in WINDOWS if noise * np.sqrt(2) / w**1.5 <= PATH_NOISE * typical]
    return trace_of(record, ratio, enough[0] if enough else WINDOWS[-1])


def prepare(record: Record, trace: Trace, base: Base) -> tuple[Study, Array]:
    """Noise, weights and candidates; and individuals (m, n) for the thresholds."""
    slope = _slope(trace, base)
    noise = estimate_noise(trace, slope)
    blocks = search_blocks(trace)
    variance, block_variance = block_variances(noise, blocks.mean(slope), blocks.count)
    n = len(variance)
    scatter, fresh = None, np.zeros((0, n))
    if base.drive is not None:
        maps, grid = cached_maps(base.drive), np.linspace(-1.5, 1.5, 601) * base.reach
        curve = base.elastic.evaluate(grid, 0.0, base.shape_start)[0]
        # Strictly rising, so that it can be turned round.
        rising = np.linspace(0, 1e-6 * base.full_torque, len(grid))
        curve = np.asarray(np.maximum.accumulate(curve) + rising, float)
        zero = _zero(trace, base)
        scatter = Scatter(maps, (grid, curve), blocks.mean(trace.twist) - zero, blocks.mean(trace.crank - trace.output),
                          blocks.mean(trace.crank), gear_share(base.drive), np.sqrt(variance))
        fresh = fresh_individuals(maps, scatter.twist, scatter.turned)
    names, left_out = candidates_of(record.missing, base)
    weights = make_weights(variance, None if scatter is None else scatter.own, n)
    return Study(base, trace, blocks, noise, weights, variance, block_variance, names, left_out, scatter), fresh


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
    return Diagnosis("insufficient", "This record allows no diagnosis: " + "; ".join(problems) + ".", (), (), (),
                     Gap(0.0, 0.0, 0.0), tuple(f"a record without this: {p}" for p in problems), notes=look.notes,
                     seconds=seconds)


def _diagnosis(record: Record, study: Study, found: Search, finding: Finding, isolated: Isolability, look: Audit,
               seconds: float) -> Diagnosis:
    chosen, base = finding.chosen, found.base
    before = study.torque - base.prediction.torque
    noise_only = float(np.sqrt(np.mean(study.block_variance)))
    systematic = max(float(np.mean(before**2)) - noise_only**2, 0.0)
    gap = gap_of(study, found.base, chosen)
    effects = tuple(as_play(named_effect(study, chosen, name, finding, base), study.base) for name in chosen.names)
    rest = study.torque - chosen.prediction.torque
    rest = rest - scattered(study, chosen, rest)
    places = locate(study, rest, finding.remainder**2) if finding.remainder > 0 else ()
    sets = [list(chosen.names), *finding.alternatives]
    nexts = splitting(sets) if len(sets) > 1 else []
    if finding.verdict in ("partly", "unknown") and places:
        nexts.append(f"the remainder lies in {places[0].coordinate} ({places[0].region}): "
                     "repeat the record there, finer")
    invisible = {**study.left_out, **isolated.invisible}
    if finding.verdict == "none":
        nexts += [f"to see {name}: {wanted(name)}" for name in list(invisible)[:4]]
    own = set(chosen.names)
    nexts += [f"{a} or {b}: " + splitting([[a], [b]])[0].split(": ", 1)[1]
              for a, b in isolated.twins if own & {a, b}][:3]
    notes = list(look.notes)
    if not study.noise.repeated:
        notes.append("no cycles repeat: the noise is taken from smoothness alone and may be too small or too large")
    fitted = chosen.parameters[1:1 + study.base.n_shape].tolist()
    shape = dict(zip(study.base.shape_names, fitted, strict=True))
    return Diagnosis(
        finding.verdict, sentence(finding, gap, study), effects, finding.alternatives,
        locate(study, before, systematic), gap, tuple(dict.fromkeys(nexts)), finding.remainder, places, invisible,
        tuple((a, b, splitting([[a], [b]])[0].split(": ", 1)[1]) for a, b in isolated.twins), tuple(notes),
        {"kind": study.base.kind, "source": study.base.source, "zero [rad]": float(chosen.parameters[0]), **shape,
         "scatter_size": chosen.weighting.size if len(chosen.weighting.strength) else 0.0,
         "full_torque [N.m]": study.base.full_torque}, seconds)


def named_effect(study: Study, fit: Fit, name: str, finding: Finding, base: Fit) -> NamedEffect:
    """One effect with its parameters and their 95 % intervals."""
    at = 1 + study.base.n_shape
    for other in fit.names:
        if other == name:
            break
        at += len(kernel(other).effect.parameters)
    deviation = deviations(study, fit)
    values = {}
    for k, p in enumerate(kernel(name).effect.parameters):
        value, z = float(fit.parameters[at + k]), float(deviation[at + k])
        if fit.box.logarithmic[at + k]:
            spread = float(np.exp(min(1.96 * z, 50.0)))
            low, high = value / spread, value * spread
        else:
            half = 1.96 * z * float(fit.box.scale[at + k])
            low, high = value - half, value + half
        low, high = max(low, p.minimum), min(high, p.maximum)
        warning = "at its bound" if fit.at_bound[at + k] else ""
        if not warning and high - low > 1.0 * abs(value) and not p.name.startswith("phase"):
            warning = "wide interval"
        values[p.name] = Value(value, low, high, p.unit, warning)
    return NamedEffect(name, values, float(np.clip(_share(study, fit, name, base), 0.0, 1.0)))


def deviations(study: Study, fit: Fit) -> Array:
    """Standard deviations (size,) of the fitted variables; a misfit beyond noise and scatter widens them."""
    scale = np.sqrt(np.maximum(np.diag(fit.curvature), 1e-300))
    correlation = fit.curvature / scale / scale[:, None]
    inverse = np.linalg.pinv(correlation + 1e-10 * np.eye(len(scale)), hermitian=True)
    expected = float((study.block_variance / study.variance).sum())
    misfit = max(1.0, fit.chi_square / expected)
    return np.sqrt(np.maximum(np.diag(inverse), 0.0) * misfit) / scale


def _share(study: Study, fit: Fit, name: str, base: Fit) -> float:
    """Part of the initial systematic gap that goes when this effect is added last."""
    from .identify import without

    noise = float(np.mean(study.block_variance))
    before = max(float(np.mean((study.torque - base.prediction.torque) ** 2)) - noise, 1e-300)
    full = float(np.mean((study.torque - fit.prediction.torque) ** 2))
    lacking = float(np.mean((study.torque - without(study, fit, name)) ** 2))
    return (lacking - full) / before if len(fit.names) > 1 else (before - max(full - noise, 0.0)) / before


def sentence(finding: Finding, gap: Gap, study: Study) -> str:
    """The verdict in one sentence."""
    names = " and ".join(kernel(n).effect.title.lower() + f" ({n})" for n in finding.chosen.names)
    shrink = f"the gap shrinks from {gap.before:.3g} to {gap.after:.3g} N.m at a noise of {gap.noise:.3g} N.m"
    full = study.base.full_torque
    match finding.verdict:
        case "named":
            return f"What is missing is {names}: {shrink}."
        case "partly":
            return (f"What is missing is {names}: {shrink}; a remainder of {finding.remainder:.3g} N.m "
                    f"({100 * finding.remainder / full:.2g} % of full torque) that no known effect explains is left.")
        case "ambiguous":
            others = "; or ".join(" and ".join(a) for a in finding.alternatives)
            return f"This record cannot tell: {names} fits ({shrink}), and so does {others}."
        case "unknown":
            return (f"Something is missing that is not known here: a gap of {finding.remainder:.3g} N.m "
                    f"({100 * finding.remainder / full:.2g} % of full torque) is beyond noise and tolerance scatter, "
                    "and no known effect explains it.")
        case _:
            pass
    return "Nothing is missing: noise and tolerance scatter explain the record."


__all__ = ["Examined", "Noise", "examine"]
