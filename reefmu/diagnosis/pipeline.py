"""The diagnosis of one record: audit, problem, isolability, search, probabilities, result."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..effects import declared_test
from ..record import TORQUE_SIDES, Record
from .analysis import Analysis, WrittenFits
from .estimation.least_squares import Fit, by_cost
from .estimation.problem import Problem
from .estimation.search import Directions, base_fit, linearise_candidates, several_effects, single_effects
from .estimation.worker_pool import WorkerPool, open_pool, spread_over
from .fitted_values import CrankLosses
from .hypotheses import IsolabilityMatrix
from .inference.evidence import Evidence
from .inference.isolability import Isolability, isolability
from .losses.crank_losses import CRANK_FRICTION, LAW, crank_losses, with_losses
from .losses.stated_friction import friction_inside, without_stated_friction
from .preparation import (
    BaseCurveSource,
    may_stand_anywhere,
    prepare_problem,
    with_first_element,
    with_friction_at_start,
    with_individuals,
)
from .preprocessing.audit import Audit, audit
from .preprocessing.trace import make_trace
from .probabilities.assessment import assess, record_isolability
from .probabilities.goodness_of_fit import global_p
from .probabilities.priors import NO_PRIORS, Priors
from .report.assemble import assemble_diagnosis, base_refusal, insufficient_diagnosis, noise_refusal
from .report.corrected_model import corrected_model, written_fit
from .report.gap import measure_gap
from .schema import Diagnosis

Progress = Callable[[str, float], None]
"""Called with the present stage and the share done."""

MAX_EFFECTS = 3
"""Largest set of effects that is fitted; chosen by judgement, since every further effect multiplies the time."""


def analyse(
    record: Record,
    source: BaseCurveSource | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
    priors: Priors = NO_PRIORS,
) -> Analysis | Diagnosis:
    """Diagnose one record against a base curve, a free power law if no source is given; only a `Diagnosis` where the
    record allows none.

    executor: of processes that share the fits; the result is the same without it. priors: what is known of the drive
    before the record is seen. Raises `InputError` for a curve file that cannot be read and for angles that show no
    transmission ratio.
    """
    report: Progress = progress or (lambda stage, share: None)
    source = source or BaseCurveSource()
    ratio, stated = source.ratio(record), source.stated_friction() if record.torque_side == "motor" else {}
    if not stated or ratio is None or not _crank_turns(record):
        found = _analyse(record, record, source, report, executor, priors, stated)
        return replace(found, keeps_stated=not stated) if isinstance(found, Analysis) else found
    started = time.perf_counter()
    solved = without_stated_friction(record, stated, ratio)
    found = _analyse(record, solved, source, report, executor, priors, stated)
    if isinstance(found, Analysis):
        model = corrected_model(found.evidence.problem, found.written.corrected)
        inside = friction_inside(model, solved)
        if inside.any():
            solved = without_stated_friction(record, stated, ratio, inside)
            found = _analyse(record, solved, source, report, executor, priors, stated)
    if isinstance(found, Analysis):
        return replace(found, diagnosis=_timed(found.diagnosis, started))
    return _timed(found, started)


def _analyse(
    measured: Record,
    record: Record,
    source: BaseCurveSource,
    report: Progress,
    executor: Executor | None,
    priors: Priors,
    stated: Mapping[str, float],
) -> Analysis | Diagnosis:
    """`analyse` for a record as measured, and as it is solved to the output. stated: friction at the crank that the
    drive states, by parameter."""
    started = time.perf_counter()
    ratio = source.ratio(record)
    audited = _with_priors(_with_torque_side(audit(measured, ratio), record, stated), priors)
    if audited.defects:
        return _timed(insufficient_diagnosis(audited, audited.defects), started)
    report("base curve", 0.0)
    losses = None if record.crank_torque is None else crank_losses(record, ratio)
    trace = make_trace(record, ratio)
    problem = prepare_problem(record, trace, source.base_curve(trace), spread_over(executor))
    if too_noisy := noise_refusal(problem):
        return _timed(insufficient_diagnosis(audited, [too_noisy]), started)
    report("single effects", 0.1)
    evidence, isolated = _single_effects(problem, executor)
    with ExitStack() as pools:
        pool = pools.enter_context(open_pool(evidence.problem, executor))
        evidence = _several_effects(evidence, pool, report)
        problem = with_friction_at_start(evidence.problem, evidence.search.all_fits)
        if problem is not evidence.problem:
            pool = pools.enter_context(open_pool(problem, executor))
            evidence = _searched_anew(evidence, pool, report)
        evidence = replace(evidence, problem=with_individuals(evidence.problem, spread=spread_over(executor)))
        report("probabilities", 0.9)
        found, problem = assess(evidence, priors, pool), evidence.problem
        base, chosen = evidence.search.base, found.conclusion.chosen
        # Another process, if there is one, computes it while this one goes on.
        sent = problem.individuals, problem.without_weights(base), problem.without_weights(chosen), found.sizes
        told_apart = pool.map(_told_apart, [sent])
        report("result", 0.95)
        written = WrittenFits(written_fit(problem, base), written_fit(problem, chosen))
        gap = measure_gap(problem, record, trace, written, found.held_out)
        if refusal := base_refusal(problem, chosen, gap):
            # Losses follow from the torques alone, whatever the base curve.
            refused = insufficient_diagnosis(audited, [refusal], gap)
            return _timed(_with_losses(refused, losses), started)
        diagnosis = assemble_diagnosis(evidence, isolated, found, written, gap, audited)
        goodness = global_p(problem, chosen)
        diagnosis = diagnosis.with_probabilities(found.hypotheses, goodness, next(told_apart))
    diagnosis = _with_losses(_with_friction_at_the_crank(diagnosis, record), losses)
    return Analysis(record, evidence, isolated, found.conclusion, written, _timed(diagnosis, started))


def _searched_anew(evidence: Evidence, pool: WorkerPool, report: Progress) -> Evidence:
    """The evidence of fits to the problem of a pool, which has the record and the candidates of the evidence."""
    base = evidence.search.base
    search = single_effects(pool, base, linearise_candidates(pool, base))
    for fit in evidence.search.best.get(1, [])[:1]:
        # A fit that starts from nothing may miss the likeliest effect where that moves the elements.
        search = search.with_single(pool.problem.fit_from(fit.names, fit.parameters, fit.weighting))
    return _several_effects(Evidence(pool.problem, search), pool, report)


def _several_effects(evidence: Evidence, pool: WorkerPool, report: Progress) -> Evidence:
    """The evidence with sets of several effects."""
    whole = several_effects(pool, evidence.search, MAX_EFFECTS, lambda stage, share: report(stage, 0.2 + 0.7 * share))
    return replace(evidence, search=whole)


def _told_apart(problem: Problem, job: tuple[Array, Fit, Fit, Mapping[str, float]]) -> IsolabilityMatrix:
    """`record_isolability` of a problem with individuals (m, n), N.m, for fits that `Problem.without_weights` sent."""
    individuals, base, chosen, sizes = job
    fits = problem.with_weights(base), problem.with_weights(chosen)
    return record_isolability(replace(problem, individuals=individuals), *fits, sizes)


def _single_effects(problem: Problem, executor: Executor | None) -> tuple[Evidence, Isolability]:
    """Fit every effect alone that this record can show, for an individual with its first element where the record shows
    it beside no effect or, where it does not, beside the likeliest one."""
    base, spread = base_fit(problem), spread_over(executor)
    with open_pool(problem, executor) as pool:
        traces = linearise_candidates(pool, base)
    problem = with_first_element(problem, base, traces, spread)
    found, isolated = _fitted_alone(problem, traces, executor)
    likeliest = min(found.search.all_fits, key=by_cost)
    if not likeliest.names or not may_stand_anywhere(problem, likeliest):
        return found, isolated
    with open_pool(problem, executor) as pool:
        seated = with_first_element(problem, likeliest, linearise_candidates(pool, likeliest), spread)
    if seated is not problem:
        found, isolated = _fitted_alone(seated, traces, executor)
        # Where a large effect moves the elements, the scatter without it leads fits astray: this one has its own.
        again = seated.fit_from(likeliest.names, likeliest.parameters, seated.weights_of_contacts(likeliest, spread))
        found = replace(found, search=found.search.with_single(again))
    return found, isolated


def _fitted_alone(problem: Problem, traces: Directions, executor: Executor | None) -> tuple[Evidence, Isolability]:
    """Every effect fitted alone that this record can show; traces: of all candidates about the fit without effects."""
    base = base_fit(problem)
    with open_pool(problem, executor) as pool:
        isolated = isolability(problem, base, traces)
        visible = tuple(name for name in problem.candidates if name not in isolated.invisible)
        problem = replace(problem, candidates=visible)
        return Evidence(problem, single_effects(replace(pool, problem=problem), base, traces)), isolated


def _with_torque_side(audited: Audit, record: Record, stated: Mapping[str, float]) -> Audit:
    """The audit with a note where the torque was not measured at the output; stated: friction at the crank that the
    drive states, by parameter."""
    if record.torque_side == "output":
        return audited
    notes = [TORQUE_SIDES[record.torque_side]]
    if stated:
        sizes = ", ".join(f"{name} {stated[name]:.3g}" for name in LAW if name in stated)
        friction = f"the friction at the crank that the drive states ({sizes})"
        notes.append(
            f"{friction} is taken off the motor's torque: effects are what is missing beside it"
            if _crank_turns(record)
            else f"{friction} is not taken off, since the record does not show how the crank turns: friction that is "
            "found contains it, and model.toml has it only once"
        )
    return replace(audited, notes=(*audited.notes, *notes))


def _crank_turns(record: Record) -> bool:
    return float(np.ptp(record.crank_angle)) > 0


def _with_priors(audited: Audit, priors: Priors) -> Audit:
    """The audit with a note of what was known before, on which the probabilities depend."""
    if priors == NO_PRIORS:
        return audited
    return replace(audited, notes=(*audited.notes, f"probabilities hold for the priors that were given: {priors}"))


def _with_friction_at_the_crank(diagnosis: Diagnosis, record: Record) -> Diagnosis:
    """The diagnosis with the named effects that friction at the crank resembles in the motor's torque, and the test
    that tells them apart; unchanged where the torque was measured at the output, which that friction does not reach."""
    if record.torque_side == "output":
        return diagnosis
    pairs = tuple(
        (effect.name, CRANK_FRICTION, test)
        for effect in diagnosis.effects
        if (test := declared_test(effect.name, CRANK_FRICTION))
    )
    return replace(diagnosis, indistinguishable=(*diagnosis.indistinguishable, *pairs))


def _with_losses(diagnosis: Diagnosis, losses: CrankLosses | str | None) -> Diagnosis:
    """The diagnosis with the losses of a record with both torques, or with the reason why it shows none; unchanged for
    None, of a record with one torque."""
    if losses is None:
        return diagnosis
    excluded = with_losses(diagnosis.not_candidates, losses)
    return replace(diagnosis, not_candidates=excluded, losses=None if isinstance(losses, str) else losses)


def _timed(diagnosis: Diagnosis, started: float) -> Diagnosis:
    return replace(diagnosis, seconds=time.perf_counter() - started)
