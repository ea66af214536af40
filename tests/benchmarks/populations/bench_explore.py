"""Designs per second and core, the parts of their computing time, and the speed-up by a second worker.

    python tests/benchmarks/populations/bench_explore.py [DESIGNS]

Goals: 100 designs per second and core at 100 virtual drives and 31 twists each; two workers 1.8 times as fast as one
for 10 000 designs, with the same results, which is checked. Times are processor times, except for the speed-up; on a
busy machine only the ratios to the bare closed form for the same elements and twists in the same run are meaningful.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from stiffness_model.equilibrium.closed_form import closed_form
from stiffness_model.explore.definition.study import Study
from stiffness_model.explore.definition.study_toml import load_study
from stiffness_model.explore.evaluation.evaluate import Evaluations, Outcome, drive_at, evaluate
from stiffness_model.explore.evaluation.response import simulate_design
from stiffness_model.explore.evaluation.sweep import draw_elements, sweep
from stiffness_model.explore.optimisation.run import run_study
from stiffness_model.explore.optimisation.search import sample

STUDIES = ("tolerance_field", "geometry")


def processor_time(work: Callable[[], object], runs: int = 5) -> float:
    """Shortest processor time of several runs, s."""
    times = []
    for _ in range(runs):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def per_design(study: Study, count: int = 48) -> None:
    """Print the computing time of a simulated design and of its parts."""
    numbers, positions = study.numbers, sample(study)
    found = evaluate(study, positions[: 4 * count])
    some = positions[: 4 * count][found.outcome == Outcome.SIMULATED][:count]
    rows = []
    for position in some:
        drive = drive_at(study, position)
        limit = drive.usable_limit
        response = simulate_design(drive, limit, numbers.torque, numbers.drives, numbers.twists, numbers.seed)
        assert response is not None
        elements = draw_elements(drive, limit, numbers.drives, numbers.seed)
        twist = response.curve.twist * drive.ratio
        rows.append(
            (
                processor_time(lambda p=position: evaluate(study, p[None])),
                processor_time(lambda e=elements, t=twist: closed_form(e.contacts, t)),
                processor_time(lambda e=elements, t=twist: sweep(e, t)),
                processor_time(lambda d=drive, x=limit: draw_elements(d, x, numbers.drives, numbers.seed)),
                processor_time(lambda d=drive, p=position: (d.usable_limit, drive_at(study, p))),
                len(elements.contacts) * len(twist),
            )
        )
    whole, solve, swept, draw, drawing, pairs = np.array(rows).T
    rest = whole - swept - draw - drawing
    print(
        f"{study.name}: {len(some)} designs of {numbers.drives} drives x {numbers.twists} twists, one core, "
        "processor time"
    )
    print(f"  a design         {1e3 * whole.mean():6.2f} ms   {1 / whole.mean():5.0f} designs a second (goal 100)")
    for name, values in (("sweep", swept), ("virtual drives", draw), ("drawing", drawing), ("metrics, range", rest)):
        print(f"    {name:14s} {1e3 * values.mean():6.2f} ms   {100 * values.sum() / whole.sum():4.0f} %")
    print(
        f"  of its pairs     {pairs.mean():6.0f} of elements and twists, {1e9 * solve.sum() / pairs.sum():.0f} ns "
        "each in the bare closed form"
    )
    print(f"  a design costs   {whole.sum() / solve.sum():6.2f} times the bare closed form\n")


def speed_up(designs: int) -> None:
    """Print the times of one and two workers, alternating, for the same designs."""
    study = load_study("geometry")
    study = replace(study, numbers=replace(study.numbers, designs=designs, generations=0))
    best: dict[int, float] = {}
    used: dict[int, tuple[float, float]] = {}
    found: dict[int, Evaluations] = {}
    for _ in range(3):
        for workers in (1, 2):
            with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(workers) as executor:
                # The processes start and import before the measurement begins.
                list(executor.map(_warm, range(4 * workers)))
                start, before = time.perf_counter(), time.process_time()
                found[workers], _ = run_study(study, Path(folder), executor)
                best[workers] = min(best.get(workers, np.inf), time.perf_counter() - start)
                own = time.process_time() - before
                children = resource.getrusage(resource.RUSAGE_CHILDREN)
                executor.shutdown()
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                theirs = after.ru_utime + after.ru_stime - children.ru_utime - children.ru_stime
                used[workers] = min(used.get(workers, (np.inf, np.inf)), (theirs, own))
    same = np.array_equal(found[1].metrics, found[2].metrics, equal_nan=True)
    print(f"{designs} designs of the study geometry, the sample alone, shortest of 3 runs")
    print(f"  one worker       {best[1]:6.2f} s    {designs / best[1]:5.0f} designs a second")
    print(f"  two workers      {best[2]:6.2f} s    {designs / best[2]:5.0f} designs a second")
    print(
        f"  two workers are  {best[1] / best[2]:6.2f} times as fast (goal 1.8); "
        f"{'the same numbers to the bit' if same else 'NOT THE SAME NUMBERS'}"
    )
    (one, _), (two, own) = used[1], used[2]
    print(
        f"  processor time   {one:6.2f} s with one, {two:.2f} s with two workers; of the parent {own:.2f} s: on two "
        f"free cores {one / (two / 2 + own):.2f} times"
    )


def _warm(_: int) -> None:
    study = load_study("geometry")
    evaluate(study, sample(study)[:2])
    time.sleep(0.1)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("designs", nargs="?", type=int, default=1000, help="for the speed-up (default 1000)")
    designs = parser.parse_args().designs
    for name in STUDIES:
        per_design(load_study(name))
    speed_up(designs)


if __name__ == "__main__":
    main()
