"""A study over any concurrent.futures executor, in chunks that are kept, so that an interrupted study can continue.

Chunks have a fixed size and every design is evaluated by itself, so the results are the same to the bit whichever
worker computes them and in whichever order they arrive. (With other processors or another NumPy the last digits may
differ.)
"""

from __future__ import annotations

import contextlib
import json
import zipfile
from collections.abc import Callable
from concurrent.futures import Executor, Future, as_completed
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...io.atomic_files import atomic_file
from ...numerics.arrays import Array
from ..definition.metrics import METRICS
from ..definition.study import Study, study_to_dict
from ..evaluation.evaluate import Evaluations, concatenate, evaluate
from .search import search

CHUNK = 16
"""Designs in one task and one file: some tenths of a second of work, so little is lost by an interruption."""
STUDY_FILE, CHUNK_FOLDER = "study.json", "chunks"


def chunk_count(study: Study) -> int:
    """Greatest number of chunks of the whole study."""
    numbers = study.numbers
    return -(-numbers.designs // CHUNK) + numbers.generations * -(-numbers.population // CHUNK)


def run_study(
    study: Study, folder: Path, executor: Executor, step: Callable[[], None] = lambda: None
) -> tuple[Evaluations, NDArray[np.intp]]:
    """Evaluate the sample and all generations. Returns them in order, and the generation of each (0: the sample).

    folder: an existing folder, which keeps the chunks; step: called after every chunk, also one that was read from the
    folder. Raises `InputError` if the folder holds a different study.
    """
    reserve_folder(study, folder)
    designs = search(study)
    positions = next(designs)
    parts: list[Evaluations] = []
    with contextlib.closing(designs), contextlib.suppress(StopIteration):
        while True:
            parts.append(_generation(study, positions, len(parts), folder / CHUNK_FOLDER, executor, step))
            positions = designs.send(parts[-1])
    return concatenate(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])


def reserve_folder(study: Study, folder: Path) -> None:
    """Write the study's identity into the folder. Raises `InputError` if it holds that of another study."""
    mark = folder / STUDY_FILE
    if mark.exists():
        try:
            there = json.loads(mark.read_text("utf-8"))
            name, identity = there["name"], there["identity"]
        except (OSError, ValueError, KeyError, TypeError):
            raise InputError(
                f"{mark}: expected the identity of a study, got something else; choose another folder"
            ) from None
        if identity != study.identity:
            raise InputError(
                f"{folder}: expected an empty folder or one of this study, got one that holds a different "
                f"study ({name!r}; another drawing, range, limit, objective, number or version)"
            )
    with atomic_file(mark) as temporary:
        temporary.write_text(json.dumps(study_to_dict(study), indent=1) + "\n", encoding="utf-8")
    (folder / CHUNK_FOLDER).mkdir(exist_ok=True)


def _generation(
    study: Study, positions: Array, number: int, folder: Path, executor: Executor, step: Callable[[], None]
) -> Evaluations:
    """Evaluate the designs of one generation, except those whose chunks are in the folder."""
    starts = range(0, len(positions), CHUNK)
    files = [folder / f"{number:05d}-{k:06d}.npz" for k in range(len(starts))]
    parts: list[Evaluations | None] = []
    waiting: dict[Future[Evaluations], int] = {}
    for k, start in enumerate(starts):
        here = positions[start : start + CHUNK]
        parts.append(_read(files[k], here))
        if parts[k] is None:
            waiting[executor.submit(evaluate, study, here)] = k
        else:
            step()
    try:
        for future in as_completed(waiting):
            k = waiting[future]
            part = future.result()
            _write(files[k], part)
            parts[k] = part
            step()
    except BaseException:
        for future, k in waiting.items():
            # Chunks that were completed meanwhile are kept too.
            if not future.cancel() and parts[k] is None and future.done() and future.exception() is None:
                _write(files[k], future.result())
        raise
    return concatenate([part for part in parts if part is not None])


def _write(file: Path, part: Evaluations) -> None:
    with atomic_file(file) as temporary, temporary.open("wb") as stream:
        np.savez(stream, positions=part.positions, metrics=part.metrics, outcome=part.outcome)


def _read(file: Path, positions: Array) -> Evaluations | None:
    """A chunk from its file; None without a file, or if it holds other designs, of another version of the optimiser."""
    try:
        # Opened here, for np.load does not close a file that it cannot read.
        with file.open("rb") as stream, np.load(stream) as held:
            part = Evaluations(held["positions"], held["metrics"], held["outcome"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    whole = part.metrics.shape == (len(positions), len(METRICS)) and part.outcome.shape == (len(positions),)
    return part if whole and np.array_equal(part.positions, positions) else None
