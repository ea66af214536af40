"""From a record and a base curve to the problem that is solved: noise, scatter, weights, candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import DAMPING, IndependentVariable, find_effect
from ...effects.effect_facts import select_candidates
from ...record import Record
from ..estimation.least_squares import Fit
from ..estimation.problem import SEARCH_BLOCKS, Problem, make_weights, search_blocks
from ..estimation.score_test import amplitude_beside_alike, linearise, rank_directions
from ..estimation.search import MIN_GAIN, base_fit
from ..forward.base_curve import BaseCurve
from ..forward.elastic import slope_by_clearance
from ..forward.predictor import Predictor
from ..preprocessing.cycle_scatter import estimate_cycle_scatter
from ..preprocessing.cycles import find_cycles
from ..preprocessing.noise import block_variances, estimate_noise
from ..preprocessing.trace import Trace
from ..preprocessing.twist_noise import at_twist_of_neighbours, noisy_paths, rate_variance
from ..random_effects.cycloidal_scatter import cycloidal_scatter
from ..random_effects.element_motion import element_motion
from ..random_effects.individuals import N_INDIVIDUALS, simulate_individuals
from ..random_effects.responses import element_responses
from ..random_effects.scatter import Scatter
from ..random_effects.tolerance_scatter import Spread, in_turn
from .channel_time_constant import TIME_CONSTANTS, channel_time_constant

UNLOADED_SHARE = 0.05
"""Share of full torque below which a sample counts as unloaded when the zero of the twist is guessed; chosen by
judgement, the fit corrects the guess."""


def prepare_problem(
    record: Record,
    trace: Trace,
    base: BaseCurve,
    spread: Spread = in_turn,
    blocks: int = SEARCH_BLOCKS,
    time_constants: Sequence[float] = TIME_CONSTANTS,
) -> Problem:
    """The problem with all candidates that the record's columns allow, without simulated individuals of a drawing;
    spread: shares the work among processes; blocks: approximate number of them; time_constants: s, from 0 on, that are
    tried first for the filter of all channels."""
    problem = _without_scatter(record, trace, base, blocks)
    return _with_noise_of_twist(_with_scatter(problem, base_fit(problem), spread, time_constants), trace)


def prepare_same_motion(record: Record, trace: Trace, other: Problem) -> Problem:
    """The problem of a record of the same drive and the same motion as that of another problem, whose scatter it has:
    only its noise and its torque are its own."""
    problem = _without_scatter(record, trace, other.base)
    weights = other.weights.with_variance(problem.variance)
    problem = replace(problem, scatter=other.scatter, individuals=other.individuals, weights=weights)
    return _with_noise_of_twist(problem, trace)


def _with_noise_of_twist(problem: Problem, trace: Trace) -> Problem:
    """The problem with the noise that damping and friction, as far as the record shows any, make of that of the twist's
    rate and path; trace: with the twist as measured."""
    base = base_fit(problem)
    added = _through_damping(problem, base, trace) + _through_friction(problem, base, trace)
    if not added.any():
        return problem
    variance = problem.variance + added
    weights = problem.weights.with_variance(variance)
    return replace(problem, variance=variance, block_variance=problem.block_variance + added, weights=weights)


def _through_damping(problem: Problem, base: Fit, trace: Trace) -> Array:
    """(n,) (N.m)^2, the noise of the twist's rate times the damping beside other friction; base: without effects."""
    if DAMPING.name not in problem.candidates:
        return np.zeros(len(problem.variance))
    coefficient = amplitude_beside_alike(problem, base, DAMPING.name)
    return coefficient**2 * rate_variance(trace, problem.blocks) if coefficient else np.zeros(len(problem.variance))


def _through_friction(problem: Problem, base: Fit, trace: Trace) -> Array:
    """(n,) (N.m)^2, what the noise of the twist's path does to the friction along it that the record shows most."""
    along_twist = [n for n in problem.candidates if IndependentVariable.TWIST in find_effect(n).friction_paths]
    directions = [direction for name in along_twist for direction in linearise(problem, name, base)]
    ranked = rank_directions(problem, base, directions, base.weighting.size)
    if not ranked or ranked[0][0] <= MIN_GAIN:
        return np.zeros(len(problem.variance))
    _, name, start = ranked[0]
    found = problem.fit_from((name,), np.concatenate([base.parameters, start]))

    def along(path: Array) -> Array:
        noisy = replace(problem.trace, smooth_twist=path)
        return Predictor(noisy, problem.base, found.names, problem.blocks)(found.parameters).torque

    errors = [along(path) - found.prediction.torque for path in noisy_paths(trace)]
    return np.mean(np.square(errors), axis=0) if errors else np.zeros(len(problem.variance))


def _without_scatter(record: Record, trace: Trace, base: BaseCurve, count: int = SEARCH_BLOCKS) -> Problem:
    slope = guess_stiffness(trace, base)
    noise = estimate_noise(trace, slope)
    blocks = search_blocks(trace, count)
    variance, block_variance = block_variances(noise, blocks.mean(slope), blocks.count)
    between = None if noise.repeated else estimate_cycle_scatter(record, trace, blocks, noise)
    if between is not None:
        variance, block_variance = variance + between.weighting_variance, block_variance + between.variance
    candidates, excluded = select_candidates(record.missing, base.kind)
    problem = Problem(
        base,
        trace,
        blocks,
        noise,
        make_weights(variance, None, base.full_torque),
        variance,
        block_variance,
        candidates,
        excluded,
        None,
        cycle_scatter=between,
        cycles=find_cycles(record, blocks),
    )
    trace = at_twist_of_neighbours(trace, blocks, base_fit(problem).prediction.slope)
    return replace(problem, trace=trace)


def with_individuals(problem: Problem, count: int = N_INDIVIDUALS, spread: Spread = in_turn) -> Problem:
    """The problem with simulated individuals of its population, where a drawing states tolerances; spread: shares the
    work among processes."""
    if not isinstance(problem.scatter, Scatter):
        return problem
    return replace(problem, individuals=simulate_individuals(problem.scatter, count, spread=spread))


def _with_scatter(problem: Problem, without_effects: Fit, spread: Spread, time_constants: Sequence[float]) -> Problem:
    """The problem with the scatter of its population, at the twist of the contacts in the fit without effects; itself
    without tolerances."""
    base, trace, blocks, twist = problem.base, problem.trace, problem.blocks, without_effects.prediction.contacts.twist
    if base.cycloidal is not None:
        scatter, individuals = cycloidal_scatter(base.cycloidal, trace, blocks, twist, base.lever)
        weights = make_weights(problem.variance, scatter, base.full_torque)
        return replace(problem, scatter=scatter, weights=weights, individuals=individuals)
    if base.drive is None:
        return problem
    motion, slope = element_motion(base.drive, trace, blocks), partial(slope_by_clearance, base.elastic)
    scatter = Scatter(base.drive, element_responses(base.drive), motion, twist, slope)
    time_constant = channel_time_constant(problem, scatter, without_effects, spread, time_constants)
    if time_constant > 0:
        motion = element_motion(base.drive, trace, blocks, time_constant)
        scatter = replace(scatter, motion=motion, time_constant=time_constant)
    return replace(problem, scatter=scatter, weights=make_weights(problem.variance, scatter, base.full_torque, spread))


def guess_stiffness(trace: Trace, base: BaseCurve) -> Array:
    """(n,) N.m/rad, stiffness of the base curve at all samples, from a first guess of its parameters."""
    zero = float(np.median(trace.twist)) if base.kind == "power law" else _zero(trace, base)
    return base.elastic.evaluate(trace.twist - zero, 0.0, base.shape.start)[1]


def _zero(trace: Trace, base: BaseCurve) -> float:
    """A first guess of the twist's zero, rad: the middle of the unloaded twists."""
    near = np.abs(trace.torque) < UNLOADED_SHARE * base.full_torque
    return float((trace.twist[near].min() + trace.twist[near].max()) / 2) if near.any() else 0.0
