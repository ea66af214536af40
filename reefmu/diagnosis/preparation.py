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

from ..model.chosen_effects import inherent_effects
from ..model.contacts.tables import cached_lookup
from ..record import Record
from .estimation.least_squares import Fit
from .estimation.likeliest_seating import with_likeliest_seating
from .estimation.problem import Problem, block_variances, make_weights, search_blocks, select_candidates
from .estimation.search import base_fit
from .estimation.weighting import INDIVIDUAL_SIZE
from .forward.base_curve import BaseCurve, curve_base, drawing_base, lookup_base, power_base, table_base
from .forward.parameter_layout import DELAY
from .losses.crank_losses import CRANK_FRICTION
from .preprocessing.audit import ratio_from_angles
from .preprocessing.cycle_scatter import estimate_cycle_scatter
from .preprocessing.cycles import find_cycles
from .preprocessing.noise import estimate_noise
from .preprocessing.trace import Trace
from .preprocessing.twist_noise import at_twist_of_neighbours
from .random_effects.cycloidal_scatter import cycloidal_scatter
from .random_effects.element_motion import element_motion
from .random_effects.individuals import N_INDIVIDUALS, simulate_individuals
from .random_effects.responses import element_responses
from .random_effects.scatter import Scatter
from .random_effects.seating import Seating
from .random_effects.tolerance_scatter import ToleranceScatter

UNLOADED_SHARE = 0.05
"""Share of full torque below which a sample counts as unloaded when the zero of the twist is guessed; chosen by
judgement, the fit corrects the guess."""
N_REPEATED, LEAST_GAIN = 4, 1.0
"""How often the elements are placed anew by the delay of a fit, and the gain in -2 log likelihood that is worth it.
Chosen by judgement: each time the delay comes nearer by a half or more."""


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


def prepare_problem(record: Record, trace: Trace, base: BaseCurve, seating: Seating | None = None) -> Problem:
    """The problem with all candidates that the record's columns allow, without simulated individuals of a drawing.

    seating: of the elements of a drive that is known, such as a simulated one; None: that which the record shows.
    """
    slope = _slope(trace, base)
    noise = estimate_noise(trace, slope)
    blocks = search_blocks(trace)
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
        make_weights(variance, None, variance),
        variance,
        block_variance,
        candidates,
        excluded,
        None,
        cycle_scatter=between,
        cycles=find_cycles(record, blocks),
    )
    trace = at_twist_of_neighbours(trace, blocks, base_fit(problem).prediction.slope)
    problem = replace(problem, trace=trace)
    return _with_scatter(problem, base_fit(problem), seating)


def with_scatter_beside(problem: Problem, fits: Sequence[Fit]) -> Problem:
    """The problem with the seats of its elements, and the way in which its torque is read late, that show beside the
    likeliest of some fits; itself where the first of them is likelier as it is. On the mean drive neither shows.

    While elements pass, a rig holds the torque or the twist. Where several pass between two samples, a torque that is
    read late is in the first case that of the elements as they are, less what it has changed by; in the second case it
    is that of the elements as they were. The record shows which.
    """
    scatter, own = problem.scatter, fits[0]
    if not isinstance(scatter, Scatter) or own.weighting.size < INDIVIDUAL_SIZE:
        return problem
    seated, found = with_likeliest_seating(problem, scatter, fits)
    best, fit = _likelier((problem, own), _with_weights(problem, seated), found)
    for _ in range(N_REPEATED):
        other, there = _likelier((best, fit), _with_elements_as_they_were(best, fit), fit)
        if other is best:
            break
        best, fit = other, there
    return best


def with_independent_scatter(problem: Problem) -> Problem:
    """The problem with a scatter of the same variances that is independent from block to block: as much as is known of
    it before the seats of the elements are; itself without scatter."""
    if problem.scatter is None:
        return problem
    columns, rest = problem.scatter.columns_at(problem.scatter.twist)
    variance = problem.variance + (columns**2).sum(axis=0) + rest[len(rest) // 2]
    weights = make_weights(variance, None, variance)
    return replace(problem, variance=variance, weights=weights, scatter=None, weights_cache=[])


def with_individuals(problem: Problem, count: int = N_INDIVIDUALS) -> Problem:
    """The problem with simulated individuals of its population, where a drawing states tolerances."""
    if not isinstance(problem.scatter, Scatter):
        return problem
    return replace(problem, individuals=simulate_individuals(problem.scatter, count))


def _likelier(fitted: tuple[Problem, Fit], other: Problem, found: Fit) -> tuple[Problem, Fit]:
    """A problem with a fit of it, or another problem with the fit from another one found, where that is likelier."""
    fit = other.fit_again(found)
    return (other, fit) if fit.cost < fitted[1].cost - LEAST_GAIN else fitted


def _with_elements_as_they_were(problem: Problem, found: Fit) -> Problem:
    """The problem with the elements where they were by the delay of a fit before every sample, and with the change of
    the torque that the change of the twist makes."""
    assert isinstance(problem.scatter, Scatter)
    blocks, trace = problem.blocks, problem.trace
    slope = blocks.spread(found.prediction.slope)
    motion = element_motion(problem.scatter.drive, trace, blocks, float(found.parameters[DELAY]))
    moved = replace(problem, trace=replace(trace, torque_rate=slope * trace.twist_rate))
    return _with_weights(moved, replace(problem.scatter, motion=motion))


def _with_scatter(problem: Problem, without_effects: Fit, seating: Seating | None) -> Problem:
    """The problem with the scatter of its population, at the twist of the contacts in the fit without effects; itself
    without tolerances."""
    base, trace, blocks, twist = problem.base, problem.trace, problem.blocks, without_effects.prediction.contact
    if base.cycloidal is not None:
        scatter, individuals = cycloidal_scatter(base.cycloidal, trace, blocks, twist, base.lever)
        return replace(_with_weights(problem, scatter), individuals=individuals)
    if base.drive is None:
        return problem
    motion = element_motion(base.drive, trace, blocks)
    scatter = Scatter(base.drive, element_responses(base.drive), motion, twist, seating)
    if seating is None:
        scatter, _ = with_likeliest_seating(problem, scatter, [without_effects])
    return _with_weights(problem, scatter)


def _with_weights(problem: Problem, scatter: ToleranceScatter) -> Problem:
    weights = make_weights(problem.variance, scatter, scatter.twist)
    return replace(problem, scatter=scatter, weights=weights, weights_cache=[])


def _slope(trace: Trace, base: BaseCurve) -> Array:
    """Stiffness, N.m/rad, of the base curve along the record, from a first guess of its parameters."""
    zero = float(np.median(trace.twist)) if base.kind == "power law" else _zero(trace, base)
    return base.elastic.evaluate(trace.twist - zero, 0.0, base.shape.start)[1]


def _zero(trace: Trace, base: BaseCurve) -> float:
    """A first guess of the twist's zero, rad: the middle of the unloaded twists."""
    near = np.abs(trace.torque) < UNLOADED_SHARE * base.full_torque
    return float((trace.twist[near].min() + trace.twist[near].max()) / 2) if near.any() else 0.0
