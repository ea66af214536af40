"""Which set of effects explains the record: all singles, pairs on the best of them, thirds, swaps, prunes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..forward.effect_functions import kernel
from .least_squares import Fit, is_logarithmic, never
from .problem import Study, amplitudes
from .score_test import Direction, directions, screen
from .weighting import SIZES
from .worker_pool import Crew

BEAM = 4
"""Sets of each size that the next effect is added to."""
FURTHER = 8
"""Candidates, the best by their scores, that are tried as a second effect; half as many as a third."""
SETTLED = 5
"""Sets of each size that are fitted to the end."""
STARTS = 2
"""Variants of a candidate that are fitted, the best by their scores."""
MOST_SWAPS = 3
"""Rounds of swapping."""
WORTH = 6.0
"""Gain by score below which a further effect is not fitted."""
ROUGH = 0.1
"""Change of the cost at which a fit ends that only ranks sets."""

Traces = Mapping[str, Sequence[Direction]]
"""Variants of every candidate about one fit."""


@dataclass(frozen=True)
class Search:
    """base: fit without effects; best: the best fits found, by number of effects, best first."""

    base: Fit
    best: dict[int, list[Fit]]


def base_fit(study: Study) -> Fit:
    """Zero and base shape alone."""
    twist = study.blocks.mean(study.trace.twist)
    starts = [0.0, float(np.median(twist))]
    near = np.abs(study.torque) < 0.05 * study.base.full_torque
    if near.any():
        starts.append(float(np.median(twist[near])))
    fits = [study.fit_from((), np.concatenate([[z], study.base.shape_start])) for z in dict.fromkeys(starts)]
    return min(fits, key=lambda f: f.cost)


def traces_of(crew: Crew, at: Fit) -> dict[str, list[Direction]]:
    """Variants of all candidates about a fit."""
    names = crew.study.candidates
    return dict(zip(names, crew.map(_traced, [(name, crew.study.slim(at)) for name in names]), strict=True))


def _traced(study: Study, job: tuple[str, Fit]) -> list[Direction]:
    return directions(study, job[0], study.whole(job[1]))


def search(
    crew: Crew, base: Fit, traces: Traces, most: int = 3, progress: Callable[[str, float], None] | None = None
) -> Search:
    """Fit singles, pairs and, where they promise anything, thirds; traces: of the candidates about the base fit."""
    study = crew.study
    best: dict[int, list[Fit]] = {0: [base]}
    for size in range(1, most + 1):
        done = partial(_tell, progress, size, most)
        done(0.0)
        parents = best[size - 1][: BEAM if size < 3 else BEAM // 2]
        starts = promising(study, base, study.candidates, traces) if size == 1 else _starts(crew, parents, frozenset())
        ranked = sorted(_best_of(fitted(crew, starts, done)).values(), key=lambda f: f.cost)
        if not ranked:
            break
        best[size] = [settled(study, fit) for fit in ranked[:SETTLED]] + ranked[SETTLED:]
        best[size].sort(key=lambda f: f.cost)
        if size >= 2 and best[size - 1][0].cost - best[size][0].cost < WORTH:
            break
        if size >= 2:
            best[size] = swapped(crew, best[size], best[size - 1], parents)
    return Search(base, best)


def swapped(crew: Crew, fits: list[Fit], smaller: list[Fit], extended_already: list[Fit]) -> list[Fit]:
    """The fits of one size with each member of the best replaced by every other candidate, until none is better.

    smaller: fits with one effect less, from which the replacements start; extended_already: those of them from which
    the fits came.
    """
    study = crew.study
    known = {frozenset(f.names): f for f in fits}
    parts = {frozenset(f.names): f for f in smaller}
    tried = {frozenset(f.names) for f in extended_already}
    for _ in range(MOST_SWAPS):
        best = min(known.values(), key=lambda f: f.cost)
        left = [frozenset(best.names) - {name} for name in best.names]
        new = [part for part in left if part not in tried]
        if not new:
            break
        tried.update(new)
        parents = [parts[part] if part in parts else study.fit_from(*part_of(study, best, part)) for part in new]
        for names, fit in _best_of(fitted(crew, _starts(crew, parents, frozenset(known)))).items():
            known[names] = settled(study, fit) if fit.cost < best.cost else fit
    return sorted(known.values(), key=lambda f: f.cost)


def part_of(study: Study, fit: Fit, names: frozenset[str]) -> tuple[tuple[str, ...], Array]:
    """Some names of a fit, and its parameters without the others'."""
    layout, parameters = study.layout(fit.names).part(names, fit.parameters)
    return layout.names, parameters


@dataclass(frozen=True)
class Start:
    """Where a fit of a set begins: names, parameters (k,), and the size of the scatter that its first steps see."""

    names: tuple[str, ...]
    parameters: Array
    size: float


def promising(
    study: Study,
    parent: Fit,
    candidates: Sequence[str],
    traces: Traces | None = None,
    known: frozenset[frozenset[str]] = frozenset(),
) -> list[Start]:
    """Starts of all sets worth a fit that have one effect more; traces: of the candidates about the parent, if there
    are any; known: sets that need none."""
    names = [
        n
        for n in candidates
        if n not in parent.names
        and frozenset((*parent.names, n)) not in known
        and find_effect(n).identification.sign_pair not in parent.names
    ]
    # `screen` is in the order of the scores; nearly all of what a further effect gains shows there.
    most = len(names) if not parent.names else FURTHER if len(parent.names) == 1 else FURTHER // 2
    floor = WORTH if parent.names else 1.0
    shown = [d for name in names for d in (directions(study, name, parent) if traces is None else traces[name])]
    # As an individual of the population and as the mean drive: the scatter bends what a small effect looks like.
    starts: list[Start] = []
    for size in dict.fromkeys((parent.weighting.size, SIZES[0])):
        taken: dict[str, int] = {}
        for gain, name, start in screen(study, parent, shown, size):
            new = name not in taken
            if gain <= floor or (new and len(taken) >= most) or taken.get(name, 0) >= (1 if parent.names else STARTS):
                continue
            taken[name] = taken.get(name, 0) + 1
            starts.append(Start((*parent.names, name), np.concatenate([parent.parameters, start]), size))
    return starts


def _starts(crew: Crew, parents: Sequence[Fit], known: frozenset[frozenset[str]]) -> list[Start]:
    """Those of several parents; each set from the first parent that promises it only where they hold three or more."""
    jobs = [(crew.study.slim(parent), crew.study.candidates, known) for parent in parents]
    found: list[Start] = []
    for starts in crew.map(_promising, jobs):
        made = {frozenset(s.names) for s in found if len(s.names) > 2}
        found += [s for s in starts if frozenset(s.names) not in made]
    return found


def _promising(study: Study, job: tuple[Fit, tuple[str, ...], frozenset[frozenset[str]]]) -> list[Start]:
    parent, candidates, known = job
    return promising(study, study.whole(parent), candidates, known=known)


def fitted(crew: Crew, starts: Sequence[Start], done: Callable[[float], None] | None = None) -> list[Fit]:
    """A fit from every start, good enough to rank; done: called with the share done."""
    fits: list[Fit] = []
    for fit in crew.map(_fitted, starts):
        fits.append(crew.study.whole(fit))
        if done:
            done(len(fits) / len(starts))
    return fits


def _tell(progress: Callable[[str, float], None] | None, size: int, most: int, share: float) -> None:
    if progress:
        progress(f"sets of {size}", (size - 1 + share) / most)


def _fitted(study: Study, start: Start) -> Fit:
    """A fit whose first steps see a scatter of this size: a wide one would swallow the effect before it is found."""
    at = start.parameters
    if start.size == SIZES[0]:
        at = study.fit_from(start.names, at, study.weights.with_size(start.size), 6, ROUGH, refit_size=False).parameters
    return study.slim(study.fit_from(start.names, at, steps=12, tolerance=ROUGH))


def _best_of(fits: Sequence[Fit]) -> dict[frozenset[str], Fit]:
    """The best fit of every set."""
    best: dict[frozenset[str], Fit] = {}
    for fit in fits:
        names = frozenset(fit.names)
        if names not in best or fit.cost < best[names].cost:
            best[names] = fit
    return best


def settled(study: Study, fit: Fit) -> Fit:
    """The set fitted to the end, under the scatter at the twist that its contacts feel."""
    weights = study.weights_at(fit)
    better = study.fit_from(fit.names, fit.parameters, weights if weights is not study.weights else None)
    return better if better.cost < fit.cost else fit


def degenerate(study: Study, fit: Fit) -> bool:
    """Whether a time, a length or a speed has run to where the record cannot resolve it: the effect then only
    imitates a simpler one."""
    t = study.trace
    step = t.step[~t.start & (t.step > 0)]
    limits = {
        "s": (2 * float(np.median(step)) if step.size else 0.0, 10 * float(t.time[-1] - t.time[0])),
        "rad/s": (0.0, 5 * float(np.abs(t.output_speed).max())),
        "rad": (0.0, 2 * study.base.reach),
    }
    for at, p in study.layout(fit.names).effect_parameters():
        low, high = limits.get(p.unit, (0.0, np.inf))
        high = np.inf if never(p) else high
        if is_logarithmic(p) and not low <= fit.parameters[at] <= high:
            return True
    return False


def n_parameters(fit: Fit) -> int:
    """Parameters of the effects of a fit."""
    return sum(len(kernel(name).effect.parameters) for name in fit.names)


def without(study: Study, fit: Fit, name: str) -> Array:
    """The fit's torque with one effect switched off and all else as it is, (n,) N.m."""
    p = fit.parameters.copy()
    first, effect = study.layout(fit.names).effects[name].start, kernel(name).effect
    for k in amplitudes(effect):
        p[first + k] = effect.parameters[k].neutral
    return study.predictor(fit.names)(p).torque
