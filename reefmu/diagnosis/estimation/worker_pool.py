"""A problem's fits shared among processes: each gets the problem once and the fits' starts as they come."""

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

from .problem import Problem

Job = TypeVar("Job")
Result = TypeVar("Result")

_held: dict[str, Problem] = {}
"""The problem that this process last worked on, by the file it came in."""


def ignore_overflow() -> np.errstate:
    """For everything that fits: a trial whose creep runs away overflows; its cost is then no number, and the fit
    refuses the step."""
    return np.errstate(over="ignore", invalid="ignore")


@dataclass(frozen=True)
class WorkerPool:
    """problem: as this process has it; executor: of processes that share the work, None to do it here;
    file: in which they find the problem."""

    problem: Problem
    executor: Executor | None = None
    file: str = ""

    def map(self, function: Callable[[Problem, Job], Result], jobs: Sequence[Job]) -> Iterator[Result]:
        """function(problem, job) of every job, in their order. The function stands in a module; a `Fit` comes back
        through `Problem.without_weights` and `Problem.with_weights`."""
        if self.executor is None:
            return map(function, [self.problem] * len(jobs), jobs)
        return self.executor.map(_work, [function] * len(jobs), [self.file] * len(jobs), jobs)


@contextmanager
def open_pool(problem: Problem, executor: Executor | None) -> Generator[WorkerPool]:
    """The problem laid out for an executor's processes; what only verdicts need stays here."""
    if executor is None:
        yield WorkerPool(problem)
        return
    with scratch_folder() as folder:
        file = folder / "problem"
        file.write_bytes(
            pickle.dumps(replace(problem, scatter=None, weights_cache=[], individuals=problem.individuals[:0]))
        )
        yield WorkerPool(problem, executor, str(file))


def _work(function: Callable[[Problem, Job], Result], file: str, job: Job) -> Result:
    if file not in _held:
        _held.clear()
        _held[file] = pickle.loads(Path(file).read_bytes())
    with ignore_overflow():
        return function(_held[file], job)
