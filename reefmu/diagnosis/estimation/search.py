"""Which set of effects explains the record: all singles, pairs on the best of them, thirds, swaps, prunes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from .least_squares import Fit, is_logarithmic, may_be_infinite
from .problem import Problem, amplitudes
from .score_test import Direction, linearise, rank_directions
from .weighting import SCATTER_SIZES
from .worker_pool import WorkerPool

BEAM_WIDTH = 4
"""Sets of each size that the next effect is added to."""
MAX_CANDIDATES = 8
"""Candidates, the best by their scores, that are tried as a second effect; half as many as a third."""
N_REFINED = 5
"""Sets of each size that are fitted to the end."""
MAX_VARIANTS = 2
"""Variants of a candidate that are fitted, the best by their scores."""
MAX_SWAP_ROUNDS = 3
"""Rounds of swapping."""
MIN_GAIN = 6.0
"""Gain by score below which a further effect is not fitted."""
COARSE_TOLERANCE = 0.1
"""Change of the cost at which a fit ends that only ranks sets."""

Directions = Mapping[str, Sequence[Direction]]
"""Variants of every candidate about one fit."""


@dataclass(frozen=True)
class Search:
    """base: fit without effects; best: the best fits found, by number of effects, best first."""

    base: Fit
    best: dict[int, list[Fit]]


def base_fit(problem: Problem) -> Fit:
    """Zero and base shape alone."""
    twist = problem.blocks.mean(problem.trace.twist)
    starts = [0.0, float(np.median(twist))]
    near = np.abs(problem.torque) < 0.05 * problem.base.full_torque
    if near.any():
        starts.append(float(np.median(twist[near])))
    fits = [problem.fit_from((), np.concatenate([[z], problem.base.shape_start])) for z in dict.fromkeys(starts)]
    return min(fits, key=lambda f: f.cost)


def linearise_candidates(pool: WorkerPool, at: Fit) -> dict[str, list[Direction]]:
    """Variants of all candidates about a fit."""
    names = pool.problem.candidates
    return dict(
        zip(names, pool.map(_linearised, [(name, pool.problem.without_weights(at)) for name in names]), strict=True)
    )


def _linearised(problem: Problem, job: tuple[str, Fit]) -> list[Direction]:
    return linearise(problem, job[0], problem.with_weights(job[1]))


def search(
    pool: WorkerPool,
    base: Fit,
    directions: Directions,
    most: int = 3,
    progress: Callable[[str, float], None] | None = None,
) -> Search:
    """Fit singles, pairs and, where they promise anything, thirds; directions: of the candidates about the base fit."""
    problem = pool.problem
    best: dict[int, list[Fit]] = {0: [base]}
    for size in range(1, most + 1):
        done = partial(_report, progress, size, most)
        done(0.0)
        parents = best[size - 1][: BEAM_WIDTH if size < 3 else BEAM_WIDTH // 2]
        starts = (
            promising_starts(problem, base, problem.candidates, directions)
            if size == 1
            else _all_starts(pool, parents, frozenset())
        )
        ranked = sorted(_best_by_set(fit_starts(pool, starts, done)).values(), key=lambda f: f.cost)
        if not ranked:
            break
        best[size] = [refine(problem, fit) for fit in ranked[:N_REFINED]] + ranked[N_REFINED:]
        best[size].sort(key=lambda f: f.cost)
        if size >= 2 and best[size - 1][0].cost - best[size][0].cost < MIN_GAIN:
            break
        if size >= 2:
            best[size] = swap_members(pool, best[size], best[size - 1], parents)
    return Search(base, best)


def swap_members(pool: WorkerPool, fits: list[Fit], smaller: list[Fit], extended_already: list[Fit]) -> list[Fit]:
    """The fits of one size with each member of the best replaced by every other candidate, until none is better.

    smaller: fits with one effect less, from which the replacements start; extended_already: those of them from which
    the fits came.
    """
    problem = pool.problem
    known = {frozenset(f.names): f for f in fits}
    parts = {frozenset(f.names): f for f in smaller}
    tried = {frozenset(f.names) for f in extended_already}
    for _ in range(MAX_SWAP_ROUNDS):
        best = min(known.values(), key=lambda f: f.cost)
        left = [frozenset(best.names) - {name} for name in best.names]
        new = [part for part in left if part not in tried]
        if not new:
            break
        tried.update(new)
        parents = [
            parts[part] if part in parts else problem.fit_from(*restrict_fit(problem, best, part)) for part in new
        ]
        for names, fit in _best_by_set(fit_starts(pool, _all_starts(pool, parents, frozenset(known)))).items():
            known[names] = refine(problem, fit) if fit.cost < best.cost else fit
    return sorted(known.values(), key=lambda f: f.cost)


def restrict_fit(problem: Problem, fit: Fit, names: frozenset[str]) -> tuple[tuple[str, ...], Array]:
    """Some names of a fit, and its parameters without the others'."""
    layout, parameters = problem.layout(fit.names).part(names, fit.parameters)
    return layout.names, parameters


@dataclass(frozen=True)
class Start:
    """Where a fit of a set begins: names, parameters (k,), and the size of the scatter that its first steps see."""

    names: tuple[str, ...]
    parameters: Array
    size: float


def promising_starts(
    problem: Problem,
    parent: Fit,
    candidates: Sequence[str],
    directions: Directions | None = None,
    known: frozenset[frozenset[str]] = frozenset(),
) -> list[Start]:
    """Starts of all sets worth a fit that have one effect more; directions: of the candidates about the parent, if any;
    known: sets that need none."""
    names = [
        n
        for n in candidates
        if n not in parent.names
        and frozenset((*parent.names, n)) not in known
        and find_effect(n).identification.sign_pair not in parent.names
    ]
    # `rank_directions` is in the order of the scores; nearly all of what a further effect gains shows there.
    most = len(names) if not parent.names else MAX_CANDIDATES if len(parent.names) == 1 else MAX_CANDIDATES // 2
    floor = MIN_GAIN if parent.names else 1.0
    shown = [
        d for name in names for d in (linearise(problem, name, parent) if directions is None else directions[name])
    ]
    # As an individual of the population and as the mean drive: the scatter bends what a small effect looks like.
    starts: list[Start] = []
    for size in dict.fromkeys((parent.weighting.size, SCATTER_SIZES[0])):
        taken: dict[str, int] = {}
        for gain, name, start in rank_directions(problem, parent, shown, size):
            new = name not in taken
            if (
                gain <= floor
                or (new and len(taken) >= most)
                or taken.get(name, 0) >= (1 if parent.names else MAX_VARIANTS)
            ):
                continue
            taken[name] = taken.get(name, 0) + 1
            starts.append(Start((*parent.names, name), np.concatenate([parent.parameters, start]), size))
    return starts


def _all_starts(pool: WorkerPool, parents: Sequence[Fit], known: frozenset[frozenset[str]]) -> list[Start]:
    """Those of several parents; each set from the first parent that promises it only where they hold three or more."""
    jobs = [(pool.problem.without_weights(parent), pool.problem.candidates, known) for parent in parents]
    found: list[Start] = []
    for starts in pool.map(_starts_of, jobs):
        made = {frozenset(s.names) for s in found if len(s.names) > 2}
        found += [s for s in starts if frozenset(s.names) not in made]
    return found


def _starts_of(problem: Problem, job: tuple[Fit, tuple[str, ...], frozenset[frozenset[str]]]) -> list[Start]:
    parent, candidates, known = job
    return promising_starts(problem, problem.with_weights(parent), candidates, known=known)


def fit_starts(pool: WorkerPool, starts: Sequence[Start], done: Callable[[float], None] | None = None) -> list[Fit]:
    """A fit from every start, good enough to rank; done: called with the share done."""
    fits: list[Fit] = []
    for fit in pool.map(_fit_start, starts):
        fits.append(pool.problem.with_weights(fit))
        if done:
            done(len(fits) / len(starts))
    return fits


def _report(progress: Callable[[str, float], None] | None, size: int, most: int, share: float) -> None:
    if progress:
        progress(f"sets of {size}", (size - 1 + share) / most)


def _fit_start(problem: Problem, start: Start) -> Fit:
    """A fit whose first steps see a scatter of this size: a wide one would swallow the effect before it is found."""
    at = start.parameters
    if start.size == SCATTER_SIZES[0]:
        at = problem.fit_from(
            start.names, at, problem.weights.with_size(start.size), 6, COARSE_TOLERANCE, refit_size=False
        ).parameters
    return problem.without_weights(problem.fit_from(start.names, at, steps=12, tolerance=COARSE_TOLERANCE))


def _best_by_set(fits: Sequence[Fit]) -> dict[frozenset[str], Fit]:
    """The best fit of every set."""
    best: dict[frozenset[str], Fit] = {}
    for fit in fits:
        names = frozenset(fit.names)
        if names not in best or fit.cost < best[names].cost:
            best[names] = fit
    return best


def refine(problem: Problem, fit: Fit) -> Fit:
    """The set fitted to the end, under the scatter at the twist that its contacts feel."""
    weights = problem.weights_at(fit)
    better = problem.fit_from(fit.names, fit.parameters, weights if weights is not problem.weights else None)
    return better if better.cost < fit.cost else fit


def is_degenerate(problem: Problem, fit: Fit) -> bool:
    """Whether a time, a length or a speed has run to where the record cannot resolve it: the effect then only
    imitates a simpler one."""
    t = problem.trace
    step = t.step[~t.start & (t.step > 0)]
    limits = {
        "s": (2 * float(np.median(step)) if step.size else 0.0, 10 * float(t.time[-1] - t.time[0])),
        "rad/s": (0.0, 5 * float(np.abs(t.output_speed).max())),
        "rad": (0.0, 2 * problem.base.max_twist),
    }
    for at, p in problem.layout(fit.names).effect_parameters():
        low, high = limits.get(p.unit, (0.0, np.inf))
        high = np.inf if may_be_infinite(p) else high
        if is_logarithmic(p) and not low <= fit.parameters[at] <= high:
            return True
    return False


def n_parameters(fit: Fit) -> int:
    """Parameters of the effects of a fit."""
    return sum(len(find_effect(name).parameters) for name in fit.names)


def torque_without(problem: Problem, fit: Fit, name: str) -> Array:
    """The fit's torque with one effect switched off and all else as it is, (n,) N.m."""
    p = fit.parameters.copy()
    first, effect = problem.layout(fit.names).effects[name].start, find_effect(name)
    for k in amplitudes(effect):
        p[first + k] = effect.parameters[k].neutral
    return problem.predictor(fit.names)(p).torque
