"""Beam search for the sets of effects that explain a record: single effects, pairs, triples, then exchanges."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from .least_squares import Fit, by_cost
from .problem import Problem
from .score_test import Direction, linearise, rank_directions
from .weighting import SCATTER_SIZES, Weighting, without_blocks
from .worker_pool import Start, WorkerPool, fit_starts, fit_under

BEAM_WIDTH = 4
"""Sets of each size that are extended by another effect, half as many from pairs on. Chosen by judgement to bound the
time of a search; exchanges make up for a narrow beam."""
MAX_CANDIDATES = 8
"""Candidates with the largest gains that are tried as a second effect, half as many as a third. Chosen by judgement."""
N_REFINED = 5
"""Sets of each size that are fitted to the full tolerance. Chosen by judgement."""
MAX_VARIANTS = 2
"""Variants of a single effect that are fitted. Chosen by judgement."""
MAX_EXCHANGES = 3
"""Greatest number of exchange rounds. Chosen by judgement to bound the time of a search."""
MIN_GAIN = 6.0
"""Gain in -2 log likelihood below which a further effect is not tried. Chosen by judgement, below significance."""
NEAR_ZERO = 0.05
"""Torque, over full torque, below which the middle of the twist is a start of its zero. Chosen by judgement."""

Directions = Mapping[str, Sequence[Direction]]
"""Variants of every candidate, linearised about one fit."""


@dataclass(frozen=True)
class Search:
    """base: fit without effects; best: fits by number of effects, lowest cost first."""

    base: Fit
    best: dict[int, list[Fit]]

    @property
    def all_fits(self) -> list[Fit]:
        """The fits of every number of effects, that without effects first."""
        return [fit for _, fits in sorted(self.best.items()) for fit in fits]

    def with_single(self, fit: Fit) -> Search:
        """With another fit of a single effect, where it is better than that which is known."""
        fits = {known.names: known for known in (fit, *self.best.get(1, []))}
        fits[fit.names] = min(fit, fits[fit.names], key=by_cost)
        return replace(self, best={**self.best, 1: sorted(fits.values(), key=by_cost)})


def base_fit(problem: Problem) -> Fit:
    """The fit of the twist's zero and the base shape alone, best of a few starts of the zero."""
    twist = problem.blocks.mean(problem.trace.twist)
    starts = [0.0, float(np.median(twist))]
    near = np.abs(problem.torque) < NEAR_ZERO * problem.base.full_torque
    if near.any():
        starts.append(float(np.median(twist[near])))
    fits = [problem.fit_from((), problem.start(z)) for z in dict.fromkeys(starts)]
    return min(fits, key=lambda f: f.cost)


def linearise_candidates(pool: WorkerPool, at: Fit) -> dict[str, list[Direction]]:
    """Variants of all candidates, linearised about a fit."""
    names, sent = pool.problem.candidates, pool.problem.without_weights(at)
    return dict(zip(names, pool.map(_linearise, [(name, sent) for name in names]), strict=True))


def _linearise(problem: Problem, job: tuple[str, Fit]) -> list[Direction]:
    return linearise(problem, job[0], problem.with_weights(job[1]))


def single_effects(pool: WorkerPool, base: Fit, directions: Directions) -> Search:
    """Fit every candidate alone. directions: of the candidates about the base fit."""
    singles = _fit_sets(pool, promising_starts(pool.problem, base, pool.problem.candidates, directions))
    return Search(base, {0: [base], 1: singles} if singles else {0: [base]})


def several_effects(
    pool: WorkerPool, singles: Search, most: int, progress: Callable[[str, float], None] | None = None
) -> Search:
    """Fit sets of up to `most` effects as well; a size that gains less than `MIN_GAIN` over the one before is the last.

    singles: of `single_effects`; progress: called with (what is done, share done).
    """
    best = dict(singles.best)
    for size in range(2, most + 1):
        report = partial(_report, progress, size, most)
        parents = best.get(size - 1, [])[: BEAM_WIDTH if size < 3 else BEAM_WIDTH // 2]
        found = _fit_sets(pool, _extensions(pool, parents, frozenset()), report)
        if not found:
            break
        best[size] = found
        if parents[0].cost - found[0].cost < MIN_GAIN:
            break
        best[size] = exchange_effects(pool, found, best[size - 1], parents)
    return Search(singles.base, best)


def _fit_sets(pool: WorkerPool, starts: Sequence[Start], report: Callable[[float], None] | None = None) -> list[Fit]:
    """The best fit of every set of some starts, the first `N_REFINED` to the full tolerance, lowest cost first."""
    ranked = sorted(_best_by_set(fit_starts(pool, starts, report)).values(), key=by_cost)
    return sorted(refine(pool, ranked[:N_REFINED]) + ranked[N_REFINED:], key=by_cost)


def _report(progress: Callable[[str, float], None] | None, size: int, most: int, share: float) -> None:
    if progress:
        progress(f"sets of {size}", (size - 1 + share) / most)


def exchange_effects(pool: WorkerPool, fits: list[Fit], smaller: list[Fit], parents: list[Fit]) -> list[Fit]:
    """The fits of one size, with each effect of the best set exchanged for every other until none is better.

    smaller: fits of one effect less; parents: those of them that were already extended by every candidate.
    """
    problem = pool.problem
    known = {frozenset(f.names): f for f in fits}
    parts = {frozenset(f.names): f for f in smaller}
    extended = {frozenset(f.names) for f in parents}
    for _ in range(MAX_EXCHANGES):
        best = min(known.values(), key=by_cost)
        reduced = [frozenset(best.names) - {name} for name in best.names]
        new = [part for part in reduced if part not in extended]
        if not new:
            break
        extended.update(new)
        bases = [parts[part] if part in parts else problem.fit_from(*restrict_fit(problem, best, part)) for part in new]
        found = list(_best_by_set(fit_starts(pool, _extensions(pool, bases, frozenset(known)))).values())
        better = refine(pool, [fit for fit in found if fit.cost < best.cost])
        known |= {frozenset(fit.names): fit for fit in (*found, *better)}
    return sorted(known.values(), key=by_cost)


def restrict_fit(problem: Problem, fit: Fit, names: frozenset[str]) -> tuple[tuple[str, ...], Array]:
    """The effects of a fit that are in `names`, in its order, and the parameters (k,) without those of the others."""
    layout, parameters = problem.layout(fit.names).restrict(names, fit.parameters)
    return layout.names, parameters


def promising_starts(
    problem: Problem,
    parent: Fit,
    candidates: Sequence[str],
    directions: Directions | None = None,
    known: frozenset[frozenset[str]] = frozenset(),
) -> list[Start]:
    """Starts of the sets of one effect more than `parent` that are worth a fit by their score tests.

    directions: of the candidates about the parent, computed if None; known: sets that are fitted already.
    """
    names = [
        n
        for n in candidates
        if n not in parent.names
        and frozenset((*parent.names, n)) not in known
        and find_effect(n).identification.sign_pair not in parent.names
    ]
    most = len(names) if not parent.names else MAX_CANDIDATES if len(parent.names) == 1 else MAX_CANDIDATES // 2
    variants, floor = (1, MIN_GAIN) if parent.names else (MAX_VARIANTS, 1.0)
    linearised = [
        d for name in names for d in (linearise(problem, name, parent) if directions is None else directions[name])
    ]
    starts: list[Start] = []
    # Under the estimated scatter and under the least: a large scatter absorbs small effects.
    for size in dict.fromkeys((parent.weighting.size, SCATTER_SIZES[0])):
        taken: dict[str, int] = {}
        for gain, name, start in rank_directions(problem, parent, linearised, size):
            full = name not in taken and len(taken) >= most
            if gain <= floor or full or taken.get(name, 0) >= variants:
                continue
            taken[name] = taken.get(name, 0) + 1
            parameters = np.concatenate([parent.parameters, start])
            starts.append(Start((*parent.names, name), parameters, parent.weighting, size))
    return starts


def _extensions(pool: WorkerPool, parents: Sequence[Fit], known: frozenset[frozenset[str]]) -> list[Start]:
    """Promising starts from several parents; a set of three or more effects only from the first parent."""
    jobs = [(pool.problem.without_weights(parent), pool.problem.candidates, known) for parent in parents]
    found: list[Start] = []
    for parent, starts in zip(parents, pool.map(_promising_starts, jobs), strict=True):
        made = {frozenset(s.names) for s in found if len(s.names) > 2}
        found += [replace(s, weights=parent.weighting) for s in starts if frozenset(s.names) not in made]
    return found


def _promising_starts(problem: Problem, job: tuple[Fit, tuple[str, ...], frozenset[frozenset[str]]]) -> list[Start]:
    parent, candidates, known = job
    starts = promising_starts(problem, problem.with_weights(parent), candidates, known=known)
    return [replace(start, weights=without_blocks(start.weights)) for start in starts]


def _best_by_set(fits: Sequence[Fit]) -> dict[frozenset[str], Fit]:
    best: dict[frozenset[str], Fit] = {}
    for fit in fits:
        names = frozenset(fit.names)
        best[names] = min(best.get(names, fit), fit, key=lambda f: f.cost)
    return best


def refine(pool: WorkerPool, fits: Sequence[Fit]) -> list[Fit]:
    """Sets fitted to all samples and to the full tolerance, with the scatter at the twist that their contacts have;
    those whose contacts have moved by then once more, whichever of the two is likelier."""
    better = _at_own_contacts(pool, fits)
    moved = [
        k
        for k, (before, after) in enumerate(zip(fits, better, strict=True))
        if after.weighting.is_individual
        and not pool.problem.are_alike(after.prediction.contacts, before.prediction.contacts)
    ]
    for k, fit in zip(moved, _at_own_contacts(pool, [better[k] for k in moved]), strict=True):
        better[k] = min(better[k], fit, key=by_cost)
    return better


def _at_own_contacts(pool: WorkerPool, fits: Sequence[Fit]) -> list[Fit]:
    """Sets fitted to all samples and to the full tolerance, with the scatter at the contacts that they have before."""
    problem, new = pool.problem, list[Fit]()
    for fit in fits:
        others = [other.prediction.contacts for other in new]
        if problem.weights_at(fit) is None and problem.are_new(fit.prediction.contacts, others):
            new.append(fit)
    for fit, weights in zip(new, pool.weights_of_contacts(new), strict=True):
        problem.remember(fit, weights)
    for fit in fits:
        if problem.weights_at(fit) is None:
            # Alike contacts of another gain: a decomposition, which is not worth sending.
            problem.remember(fit, problem.weights_of_contacts(fit))
    better = fit_under(pool, fits, [_known(problem, fit) for fit in fits])
    moved = [new.prediction.contacts.gain / old.prediction.contacts.gain for new, old in zip(better, fits, strict=True)]
    again = [k for k, fit in enumerate(better) if fit.weighting.is_individual and (moved[k] != 1).any()]
    weights = [better[k].weighting.with_gain(moved[k]) for k in again]
    for k, fit in zip(again, fit_under(pool, [better[k] for k in again], weights), strict=True):
        better[k] = fit
    if problem.for_ranking is not problem:
        return better
    return [min(pair, key=lambda fit: fit.cost) for pair in zip(fits, better, strict=True)]


def _known(problem: Problem, fit: Fit) -> Weighting:
    weights = problem.weights_at(fit)
    assert weights is not None, "the scatter at the contacts of every set was computed before"
    return weights
