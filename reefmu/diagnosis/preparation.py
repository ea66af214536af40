"""From a record and a base curve to the problem that is solved: noise, scatter, weights, candidates."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.kinds import AnyDrive
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.numerics.arrays import Array

from ..effects import DAMPING
from ..effects.effect_facts import select_candidates
from ..model.chosen_effects import inherent_effects
from ..model.contacts.tables import cached_lookup
from ..record import Record
from .estimation.least_squares import Fit
from .estimation.problem import SEARCH_BLOCKS, Problem, make_weights, search_blocks
from .estimation.score_test import amplitude_beside_alike
from .estimation.search import base_fit
from .estimation.weighting import INDIVIDUAL_SIZE, SCATTER_SIZES, Weighting, weighting_of_covariance
from .forward.base_curve import BaseCurve, curve_base, drawing_base, lookup_base, power_base, table_base
from .losses.crank_losses import CRANK_FRICTION
from .preprocessing.audit import ratio_from_angles
from .preprocessing.cycle_scatter import estimate_cycle_scatter
from .preprocessing.cycles import find_cycles
from .preprocessing.noise import block_variances, estimate_noise
from .preprocessing.trace import Trace
from .preprocessing.twist_noise import at_twist_of_neighbours, rate_variance
from .random_effects.cycloidal_scatter import cycloidal_scatter
from .random_effects.element_motion import element_motion
from .random_effects.individuals import N_INDIVIDUALS, simulate_individuals
from .random_effects.responses import element_responses
from .random_effects.scatter import Scatter
from .random_effects.tolerance_scatter import Spread, in_turn

UNLOADED_SHARE = 0.05
"""Share of full torque below which a sample counts as unloaded when the zero of the twist is guessed; chosen by
judgement, the fit corrects the guess."""

TIME_CONSTANTS = tuple(1e-4 * k for k in range(11))
"""s, that are tried for the filter of all channels: bandwidths from 160 Hz on. Where elements pass faster, a fast run
hardly shows them. The likelihood has several maxima, of which one is 0.1 ms wide."""
FEW_STARTS = 2
"""Positions of the first element by which they are compared; with 12 the costs of two simulated individuals differ by
up to 100, where that of the likeliest is 350 to 960 below the unfiltered one, and the likeliest is the same."""
LEAST_TURN = 1.0
"""rad, of the crank, from which a run shows elements that pass; chosen by judgement, the width of a profile."""


@dataclass(frozen=True)
class BaseCurveSource:
    """Where the base curve comes from: a drive, a curve file, or a function of the record's traces; a free power law
    if none of them is given."""

    drive: AnyDrive | None = None
    curve: str | os.PathLike[str] | None = None
    make: Callable[[Trace], BaseCurve] | None = None

    def ratio(self, record: Record) -> float | None:
        """Signed transmission ratio of the drawing, else the one that the angles of the record show, if any."""
        return ratio_from_angles(record) if self.drive is None else self.drive.ratio

    def stated_friction(self) -> dict[str, float]:
        """Parameters of the friction at the crank that the drive states, by name; none without it."""
        return {} if self.drive is None else inherent_effects(self.drive).get(CRANK_FRICTION, {})

    def base_curve(self, trace: Trace) -> BaseCurve:
        """The base curve for a record with these traces."""
        if self.make is not None:
            return self.make(trace)
        if isinstance(self.drive, Drive):
            return drawing_base(self.drive, cached_lookup(self.drive))
        if self.drive is not None:
            lookup = cached_lookup(self.drive)
            if isinstance(lookup, CurveLookup):
                return lookup_base(self.drive, lookup)
            return table_base(self.drive, lookup)
        return power_base(trace) if self.curve is None else curve_base(self.curve, trace.ratio)


def prepare_problem(
    record: Record, trace: Trace, base: BaseCurve, spread: Spread = in_turn, blocks: int = SEARCH_BLOCKS
) -> Problem:
    """The problem with all candidates that the record's columns allow, without simulated individuals of a drawing;
    spread: shares the work among processes; blocks: approximate number of them."""
    problem = _without_scatter(record, trace, base, blocks)
    return _with_damped_noise(_with_scatter(problem, base_fit(problem), spread), trace)


def prepare_same_motion(record: Record, trace: Trace, other: Problem) -> Problem:
    """The problem of a record of the same drive and the same motion as that of another problem, whose scatter it has:
    only its noise and its torque are its own."""
    problem = _without_scatter(record, trace, other.base)
    weights = other.weights.with_variance(problem.variance)
    problem = replace(problem, scatter=other.scatter, individuals=other.individuals, weights=weights)
    return _with_damped_noise(problem, trace)


def _with_damped_noise(problem: Problem, trace: Trace) -> Problem:
    """The problem with the noise that damping, as far as the record shows any beside friction, makes of that of the
    twist's rate; trace: with the twist as measured."""
    if DAMPING.name not in problem.candidates:
        return problem
    coefficient = amplitude_beside_alike(problem, base_fit(problem), DAMPING.name)
    if coefficient == 0:
        return problem
    added = coefficient**2 * rate_variance(trace, problem.blocks)
    variance = problem.variance + added
    weights = problem.weights.with_variance(variance)
    return replace(problem, variance=variance, block_variance=problem.block_variance + added, weights=weights)


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


def _with_scatter(problem: Problem, without_effects: Fit, spread: Spread) -> Problem:
    """The problem with the scatter of its population, at the twist of the contacts in the fit without effects; itself
    without tolerances."""
    base, trace, blocks, twist = problem.base, problem.trace, problem.blocks, without_effects.prediction.contacts.twist
    if base.cycloidal is not None:
        scatter, individuals = cycloidal_scatter(base.cycloidal, trace, blocks, twist, base.lever)
        weights = make_weights(problem.variance, scatter, base.full_torque)
        return replace(problem, scatter=scatter, weights=weights, individuals=individuals)
    if base.drive is None:
        return problem
    scatter = Scatter(base.drive, element_responses(base.drive), element_motion(base.drive, trace, blocks), twist)
    residual = problem.torque - without_effects.prediction.torque
    time_constant = channel_time_constant(problem, scatter, residual, spread)
    if time_constant > 0:
        motion = element_motion(base.drive, trace, blocks, time_constant)
        scatter = replace(scatter, motion=motion, time_constant=time_constant)
    return replace(problem, scatter=scatter, weights=make_weights(problem.variance, scatter, base.full_torque, spread))


def channel_time_constant(problem: Problem, scatter: Scatter, residual: Array, spread: Spread) -> float:
    """s, the likeliest time constant of the filter that all channels have passed, beside a residual (n,), N.m.

    Where elements pass at several speeds, it shows in the runs that turn, each of which may have friction of its own,
    and all damping. It is 0 where a mean drive is likelier than an individual: no single element shows there.
    """
    drive, trace, blocks = scatter.drive, problem.trace, problem.blocks
    run = trace.run[blocks.first]
    turns = np.isin(run, [r for r in np.unique(run) if np.ptp(trace.crank[trace.run == r]) > LEAST_TURN])
    speed = blocks.mean(np.abs(trace.crank_speed))[turns]
    if not turns.any() or speed.max() * TIME_CONSTANTS[-1] < 2 * np.pi / drive.elements / 10:
        return 0.0
    of_runs = (run[turns, None] == np.unique(run[turns])).astype(float)
    free = np.concatenate([of_runs, blocks.mean(trace.twist_rate)[turns, None]], axis=1)

    def by_size(time_constant: float) -> list[float]:
        motion = element_motion(drive, trace, blocks, time_constant).of_blocks(turns)
        some = replace(scatter, motion=motion, twist=scatter.twist[turns], starts=FEW_STARTS)
        weights = weighting_of_covariance(problem.variance[turns], some.covariance_at(some.twist, spread=spread))
        weights = weights.with_unknown_forms(problem.base.full_torque)
        return [_cost_beside(weights.with_size(size), residual[turns], free) for size in SCATTER_SIZES]

    def cost(time_constant: float) -> float:
        return min(by_size(time_constant))

    unfiltered = by_size(0.0)
    if SCATTER_SIZES[int(np.argmin(unfiltered))] < INDIVIDUAL_SIZE:
        return 0.0
    coarse = {0.0: min(unfiltered)} | {tried: cost(tried) for tried in TIME_CONSTANTS[1:]}
    likeliest = min(coarse, key=lambda tried: coarse[tried])
    if likeliest in (TIME_CONSTANTS[0], TIME_CONSTANTS[-1]):
        return likeliest
    half = (TIME_CONSTANTS[1] - TIME_CONSTANTS[0]) / 2
    return _vertex(likeliest, half, [cost(likeliest - half), coarse[likeliest], cost(likeliest + half)])


def _vertex(middle: float, step: float, costs: Sequence[float]) -> float:
    """Where a parabola through three costs has its least value, at most a step from the middle."""
    before, least, after = costs
    bend = before - 2 * least + after
    return middle + step * float(np.clip(0.5 * (before - after) / bend, -1, 1)) if bend > 0 else middle


def _cost_beside(weights: Weighting, residual: Array, columns: Array) -> float:
    """-2 log likelihood of a residual (n,), N.m, beside free columns (n, k)."""
    white = weights.whiten(columns)
    amplitudes = np.linalg.lstsq(white, weights.whiten(residual), rcond=None)[0]
    return weights.cost(residual - columns @ amplitudes)


def guess_stiffness(trace: Trace, base: BaseCurve) -> Array:
    """(n,) N.m/rad, stiffness of the base curve at all samples, from a first guess of its parameters."""
    zero = float(np.median(trace.twist)) if base.kind == "power law" else _zero(trace, base)
    return base.elastic.evaluate(trace.twist - zero, 0.0, base.shape.start)[1]


def _zero(trace: Trace, base: BaseCurve) -> float:
    """A first guess of the twist's zero, rad: the middle of the unloaded twists."""
    near = np.abs(trace.torque) < UNLOADED_SHARE * base.full_torque
    return float((trace.twist[near].min() + trace.twist[near].max()) / 2) if near.any() else 0.0
