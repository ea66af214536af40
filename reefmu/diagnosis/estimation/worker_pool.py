"""A study's fits shared among processes: each gets the study once and the fits' starts as they come."""

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

from .problem import Study

Job = TypeVar("Job")
Result = TypeVar("Result")

_held: dict[str, Study] = {}
"""The study that this process last worked on, by the file it came in."""


def trials() -> np.errstate:
    """For everything that fits: a trial whose creep runs away overflows; its cost is then no number, and the fit
    refuses the step."""
    return np.errstate(over="ignore", invalid="ignore")


@dataclass(frozen=True)
class Crew:
    """study: as this process has it; executor: of processes that share the work, None to do it here;
    file: in which they find the study."""

    study: Study
    executor: Executor | None = None
    file: str = ""

    def map(self, function: Callable[[Study, Job], Result], jobs: Sequence[Job]) -> Iterator[Result]:
        """function(study, job) of every job, in their order. The function stands in a module; a `Fit` comes back
        through `Study.slim` and `Study.whole`."""
        if self.executor is None:
            return map(function, [self.study] * len(jobs), jobs)
        return self.executor.map(_work, [function] * len(jobs), [self.file] * len(jobs), jobs)


@contextmanager
def crew_of(study: Study, executor: Executor | None) -> Generator[Crew]:
    """The study laid out for an executor's processes; what only verdicts need stays here."""
    if executor is None:
        yield Crew(study)
        return
    with scratch_folder() as folder:
        file = folder / "study"
        file.write_bytes(pickle.dumps(replace(study, scatter=None, shifted=[], individuals=study.individuals[:0])))
        yield Crew(study, executor, str(file))


def _work(function: Callable[[Study, Job], Result], file: str, job: Job) -> Result:
    if file not in _held:
        _held.clear()
        _held[file] = pickle.loads(Path(file).read_bytes())
    with trials():
        return function(_held[file], job)
