"""Fits shared among processes: each process reads the problem once, then receives the jobs."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from stiffness_model.io.atomic_files import scratch_folder

from ..random_effects.tolerance_scatter import Spread, in_turn
from .least_squares import Fit
from .problem import Problem
from .weighting import Weighting

Job = TypeVar("Job")
Result = TypeVar("Result")

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
        """`Problem.weights_of_contacts` of each fit: those of several fits side by side, those of one by parts."""
        if len(fits) == 1:
            return iter([self.problem.weights_of_contacts(fits[0], spread_over(self.executor))])
        return self.map(Problem.weights_of_contacts, [self.problem.without_weights(fit) for fit in fits])


def spread_over(executor: Executor | None) -> Spread:
    """Shares jobs among the processes of an executor; None to work in this one."""
    return in_turn if executor is None else executor.map


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
