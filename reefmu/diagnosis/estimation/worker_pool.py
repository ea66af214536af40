"""Fits shared among processes: each process reads the problem once, then receives the jobs.

Sets of effects are ranked by fits under the scatter at the contacts of the set that they extend, which a wear or a
thermal clearance moves: under that of a drive without effects the true set ranked behind false ones.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TypeVar

import numpy as np

from stiffness_model.io.atomic_files import scratch_folder
from stiffness_model.numerics.arrays import Array

from ..random_effects.tolerance_scatter import Spread, in_turn
from .least_squares import Fit, FitOptions
from .problem import Problem
from .weighting import SCATTER_SIZES, Weighting, has_no_blocks, without_blocks

Job = TypeVar("Job")
Result = TypeVar("Result")

RANKING = FitOptions(steps=12, tolerance=0.1)
"""A fit good enough to rank sets. Chosen by judgement, well below the gains that decide."""
FIRST_STEPS = FitOptions(steps=6, tolerance=0.1, estimate_size=False)
"""The first steps under the least scatter. Chosen by judgement."""
N_SHARES = 2
"""Jobs for the starts under the weights of one set, which are sent with each; chosen by judgement."""

_loaded: dict[str, Problem] = {}
"""The problem that this process read last, by its file."""


def ignore_overflow() -> np.errstate:
    """A context for fits: the trajectory of a trial point may overflow, its cost is then not finite, and the fit
    rejects the step."""
    return np.errstate(over="ignore", invalid="ignore")


@dataclass(frozen=True)
class WorkerPool:
    """problem: in this process; executor: of the processes, None to work in this one; file: the problem for them."""

    problem: Problem
    executor: Executor | None = None
    file: str = ""

    def map(self, function: Callable[[Problem, Job], Result], jobs: Sequence[Job]) -> Iterator[Result]:
        """function(problem, job) for every job, in their order.

        The function must be defined in a module. A `Fit` travels through `Problem.without_weights` and
        `Problem.with_weights`.
        """
        if self.executor is None:
            return map(function, [self.problem] * len(jobs), jobs)
        return self.executor.map(_work, [function] * len(jobs), [self.file] * len(jobs), jobs)

    def weights_of_contacts(self, fits: Sequence[Fit]) -> Iterator[Weighting]:
        """`Problem.weights_of_contacts` of each fit: those of two fits side by side, that of a last one by parts."""
        pairs = len(fits) - len(fits) % 2
        sent = [self.problem.without_weights(fit) for fit in fits[:pairs]]
        spread = spread_over(self.executor)
        by_parts = (self.problem.weights_of_contacts(fit, spread) for fit in fits[pairs:])
        return chain(self.map(Problem.weights_of_contacts, sent), by_parts)


@dataclass(frozen=True)
class Start:
    """Where the fit of a set begins: its names, parameters (k,), the weights of the set that it extends, and the size
    of the scatter for the first steps."""

    names: tuple[str, ...]
    parameters: Array
    weights: Weighting
    size: float


def fit_starts(pool: WorkerPool, starts: Sequence[Start], report: Callable[[float], None] | None = None) -> list[Fit]:
    """A fit from every start, good enough to rank, those of equal weights together; report: called with the share
    done."""
    groups: dict[tuple[int, int], list[Start]] = {}
    for start in starts:
        groups.setdefault((id(start.weights.basis), id(start.weights.scale)), []).append(start)
    jobs = [job for group in groups.values() for job in _jobs(pool.problem, group)]
    fits: list[Fit] = []
    for (weights, _), found in zip(jobs, pool.map(_fit_starts, [job for _, job in jobs]), strict=True):
        fits += [replace(fit, weighting=weights.with_size(fit.weighting.size)) for fit in found]
        if report:
            report(len(fits) / len(starts))
    return fits


def _jobs(problem: Problem, starts: Sequence[Start]) -> Iterator[tuple[Weighting, list[Start]]]:
    """The weights of some starts, and shares of them as they are sent: without weights that the processes have."""
    weights = starts[0].weights
    sent, count = (without_blocks(weights), 1) if problem.has(weights) else (weights, -(-len(starts) // N_SHARES))
    for first in range(0, len(starts), count):
        yield weights, [replace(start, weights=sent) for start in starts[first : first + count]]


def _fit_starts(problem: Problem, starts: Sequence[Start]) -> list[Fit]:
    """Fits whose first steps keep the scatter least: a large scatter would absorb the effect before it is found."""
    found: list[Fit] = []
    for start in starts:
        weights = problem.weights if has_no_blocks(start.weights) else start.weights
        at, ranking = start.parameters, problem.for_ranking
        if start.size == SCATTER_SIZES[0]:
            at = ranking.fit_from(start.names, at, weights.with_size(start.size), FIRST_STEPS).parameters
        fit = ranking.fit_from(start.names, at, weights.with_size(problem.weights.size), RANKING)
        found.append(replace(fit, weighting=without_blocks(fit.weighting)))
    return found


def fit_under(pool: WorkerPool, fits: Sequence[Fit], weights: Sequence[Weighting]) -> list[Fit]:
    """Every fit continued to the full tolerance under given weights, of the size of the scatter that is then
    likeliest."""
    under = (replace(fit, weighting=own) for fit, own in zip(fits, weights, strict=True))
    better = zip(pool.map(_continued, [pool.problem.without_weights(fit) for fit in under]), weights, strict=True)
    return [replace(fit, weighting=own.with_size(fit.weighting.size)) for fit, own in better]


def _continued(problem: Problem, sent: Fit) -> Fit:
    fit = problem.with_weights(sent)
    found = problem.fit_from(fit.names, fit.parameters, fit.weighting)
    return replace(found, weighting=without_blocks(found.weighting))


def spread_over(executor: Executor | None) -> Spread:
    """Shares jobs between this process, which does the first, and those of an executor; None to work in this one."""
    if executor is None:
        return in_turn

    def spread(function: Callable[[Job], Result], jobs: Iterable[Job], /) -> Iterator[Result]:
        listed = list(jobs)
        elsewhere = executor.map(function, listed[1:])
        return chain([function(job) for job in listed[:1]], elsewhere)

    return spread


@contextmanager
def open_pool(problem: Problem, executor: Executor | None) -> Generator[WorkerPool]:
    """A pool for one problem, which the processes read from a file."""
    if executor is None:
        yield WorkerPool(problem)
        return
    with scratch_folder() as folder:
        file = folder / "problem"
        file.write_bytes(pickle.dumps(replace(problem, weights_cache=[])))
        yield WorkerPool(problem, executor, str(file))


def _work(function: Callable[[Problem, Job], Result], file: str, job: Job) -> Result:
    if file not in _loaded:
        _loaded.clear()
        _loaded[file] = pickle.loads(Path(file).read_bytes())
    with ignore_overflow():
        return function(_loaded[file], job)
