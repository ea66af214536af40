"""Scores the diagnosis, and other methods, on blind cases (tests/validation/blind).

Run as `python tests/benchmarks/diagnosis/bench_diagnosis.py --count 300 --workers 2`. Every case is made, diagnosed
and judged in one process of a pool; an engine gets the paths of a record and a drawing and nothing else.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[3]), str(Path(__file__).resolve().parent)]

import baselines  # noqa: E402

from reefmu.cli import BLAS_THREADS  # noqa: E402
from stiffness_model import DoesNotFitWarning  # noqa: E402
from tests.validation.blind.cases import WEIGHTS, case  # noqa: E402
from tests.validation.blind.records import Case, make  # noqa: E402
from tests.validation.blind.scoring import Outcome, by_effect, confusions, failed, figures, judge  # noqa: E402

Answer = dict[str, Any]


def reefmu_engine(record: Path, drawing: Path) -> Answer:
    """The diagnosis of this package, in the form of diagnosis.json."""
    from reefmu.diagnosis import diagnose_record

    found = diagnose_record(record, drive=drawing)
    return found if isinstance(found, dict) else found.to_dict()


def command_engine(record: Path, drawing: Path) -> Answer:
    """The same through the command line."""
    out = record.parent / "out"
    call = ["diagnose", str(record), "--drive", str(drawing), "--out", str(out)]
    subprocess.run([sys.executable, "-m", "reefmu", *call], check=True, capture_output=True)
    return json.loads((out / "diagnosis.json").read_text("utf-8"))


ENGINES: dict[str, Callable[[Path, Path], Answer]] = {
    "reefmu": reefmu_engine,
    "command": command_engine,
    **{method: partial(baselines.diagnose, method) for method in baselines.METHODS},
}


def score_case(what: Case, engines: tuple[str, ...]) -> dict[str, Outcome]:
    """Make one case and judge the answers of the engines."""
    warnings.simplefilter("ignore", DoesNotFitWarning)
    made = make(what)
    out = {}
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = made.write(Path(folder))
        for name in engines:
            start = time.perf_counter()
            try:
                answer = ENGINES[name](record, drawing)
                out[name] = judge(made.truth, answer, time.perf_counter() - start)
            except Exception as error:  # an error is a result of the engine
                text = f"{type(error).__name__}: {str(error)[:200]}"
                out[name] = failed(made.truth, text, time.perf_counter() - start)
    return out


def run(cases: list[Case], engines: tuple[str, ...], workers: int) -> dict[str, list[Outcome]]:
    """Outcomes of every engine over the cases; prints one line per case."""
    # One thread a process, set before the children import NumPy: the pool is the parallelism.
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")
    rows: dict[str, list[Outcome]] = {name: [] for name in engines}
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        waiting = {pool.submit(score_case, what, engines): what for what in cases}
        for done, future in enumerate(as_completed(waiting), 1):
            outcome = future.result()
            for name in engines:
                rows[name].append(outcome[name])
            first = outcome[engines[0]]
            print(
                f"{done:4d}/{len(cases)}  case {first.truth.case.number:4d} {first.truth.case.category:14s} "
                f"{'ok ' if first.exact else '   '} {first.verdict:12s} {first.seconds:5.1f} s",
                flush=True,
            )
    return {name: sorted(found, key=lambda o: o.truth.case.number) for name, found in rows.items()}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="number of cases (default 300)")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=0, help="catalogue; another seed gives other cases")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--engines", default="reefmu", help=f"comma-separated, of {', '.join(ENGINES)}")
    parser.add_argument("--categories", default=",".join(WEIGHTS), help="only these categories of the cases")
    parser.add_argument("--individuals", action="store_true", help="every drive with parts of its own")
    parser.add_argument(
        "--places", type=float, default=0.0, help="individuals' bores and lobes off their places, over sizes"
    )
    parser.add_argument("--torque-delay", type=float, default=0.0, help="s, by which the torque is read late")
    parser.add_argument("--rows", type=Path, help="write all outcomes to this JSON file")
    options = parser.parse_args(arguments)
    engines = []
    for name in options.engines.split(","):
        if name not in ENGINES:
            parser.error(f"unknown engine {name!r}; expected one of {', '.join(ENGINES)}")
        if reason := baselines.reason_to_skip(name):
            print(f"{name}: skipped, {reason}")
        else:
            engines.append(name)
    wanted = options.categories.split(",")
    if unknown := set(wanted) - set(WEIGHTS):
        parser.error(f"unknown categories {', '.join(sorted(unknown))}; expected some of {', '.join(WEIGHTS)}")
    chosen = [case(n, options.seed) for n in range(options.first, options.first + options.count)]
    cases = [
        replace(
            c,
            individual=c.individual or options.individuals,
            places=options.places,
            sensors=replace(c.sensors, torque_delay=options.torque_delay),
        )
        for c in chosen
        if c.category in wanted
    ]
    rows = run(cases, tuple(engines), options.workers) if engines else {}
    for name, found in rows.items():
        print(f"\n== {name}, {len(found)} cases\n{figures(found)}\n\n{by_effect(found)}\n\n{confusions(found)}")
    if options.rows:
        options.rows.write_text(json.dumps({name: [asdict(o) for o in found] for name, found in rows.items()}), "utf-8")


if __name__ == "__main__":
    main()
