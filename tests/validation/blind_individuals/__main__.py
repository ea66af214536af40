"""Generates, diagnoses and scores: see the package's own words for how to call it."""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
KEPT = ("schema", "verdict", "sentence", "notes", "effects", "alternatives", "hypotheses", "global_p", "twins", "gap")
"""Keys of diagnosis.json that a row of results keeps."""


def examined(seed: int, number: int) -> dict[str, Any]:
    """The row of one case: truth, answer, seconds and processor seconds of the diagnosis, its error if it failed."""
    from reefmu.diagnosis import diagnose_record
    from stiffness_model import DoesNotFitWarning

    from .catalogue import case
    from .records import make

    warnings.simplefilter("ignore", DoesNotFitWarning)
    sealed = make(case(number, seed))
    row: dict[str, Any] = {"truth": sealed.truth.to_dict(), "answer": None, "error": ""}
    with tempfile.TemporaryDirectory() as folder:
        # The names of the files say nothing of what is inside.
        record, drawing = Path(folder, "record.csv"), Path(folder, "drive.toml")
        record.write_text(sealed.record, encoding="utf-8")
        drawing.write_text(sealed.drawing, encoding="utf-8")
        start, processor = time.perf_counter(), time.process_time()
        try:
            answer = diagnose_record(record, drive=drawing).to_dict()
            row["answer"] = {key: answer[key] for key in KEPT if key in answer}
        except Exception as error:  # a crash is a result of the examined, not of the examiner
            row["error"] = f"{type(error).__name__}: {str(error)[:200]}"
        row["seconds"], row["processor"] = time.perf_counter() - start, time.process_time() - processor
    return row


def rows(seed: int, numbers: Sequence[int], workers: int) -> Iterator[dict[str, Any]]:
    """The rows of some cases as they come."""
    if workers == 1:
        yield from (examined(seed, number) for number in numbers)
        return
    # By its name as a module: a worker does not run the script itself, where a function of `__main__` would be.
    from tests.validation.blind_individuals.__main__ import examined as examined_by_worker

    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        for future in as_completed([pool.submit(examined_by_worker, seed, number) for number in numbers]):
            yield future.result()


def read_rows(*paths: Path) -> list[dict[str, Any]]:
    """Rows of results files, by seed and case number."""
    lines = [line for path in paths for line in path.read_text(encoding="utf-8").splitlines()]
    found = [json.loads(line) for line in lines if line.strip()]
    return sorted(found, key=lambda row: (row["truth"]["seed"], row["truth"]["number"]))


def score(found: Sequence[dict[str, Any]]) -> str:
    """All tables of some rows."""
    from . import figures
    from .judging import judge

    outcomes = [judge(row) for row in found]
    tables = (figures.counts, figures.table, figures.reliability, figures.confusion, figures.misses)
    return "\n\n".join(make(outcomes) for make in tables)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.blind_individuals", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="catalogue; another seed gives other cases")
    parser.add_argument("--count", type=int, default=100, help="cases (default 100)")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, help="results, a line a case; cases that it already holds are left out")
    parser.add_argument("--score", type=Path, nargs="+", metavar="FILE", help="print the tables of results files")
    options = parser.parse_args(arguments)
    if options.score is not None:
        print(score(read_rows(*options.score)))
        return
    # One thread a process, set before NumPy is imported by the workers: the pool is the parallelism.
    for name in THREADS:
        os.environ.setdefault(name, "1")
    done = []
    if options.out is not None and options.out.is_file():
        done = [row for row in read_rows(options.out) if row["truth"]["seed"] == options.seed]
    known = {row["truth"]["number"] for row in done}
    numbers = [n for n in range(options.first, options.first + options.count) if n not in known]
    for row in rows(options.seed, numbers, options.workers):
        done.append(row)
        if options.out is not None:
            with options.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        truth = row["truth"]
        verdict = row["error"][:40] or row["answer"]["verdict"]
        print(
            f"case {truth['number']:4d}  {truth['category']:18s} {verdict:14s} {row['seconds']:5.1f} s", file=sys.stderr
        )
    print(score(sorted(done, key=lambda row: row["truth"]["number"])))


if __name__ == "__main__":
    main()
