"""Compares the probabilities that `reefmu plan` predicts with diagnoses of simulated records along its protocol, and
its duration with that of the full protocol of the blind catalogue.

Run as `python tests/benchmarks/diagnosis/bench_plan_power.py --cases 200 --workers 2`. Every case is a drive of the
population with one effect of typical size, or with none, and random shape parameters, measured along the protocol with
the noise of the rig. An effect counts as named where the verdict is `named` and it is the only one.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import os
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from reefmu.cli import BLAS_THREADS
from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.discrimination.effect_columns import draw_parameters
from reefmu.diagnosis.discrimination.predicted_isolability import PredictedIsolability
from reefmu.diagnosis.estimation.score_test import linearise
from reefmu.effects import EFFECTS
from reefmu.planning import Plan, Rig, load_rig, make_plan
from reefmu.planning.diagnosis_link import record_problem
from reefmu.planning.protocols.motion_pieces import Piece
from reefmu.planning.protocols.schedule import Schedule, make_schedule, measured_record
from reefmu.planning.setting import check_schedule, prepare_setting
from stiffness_model import DoesNotFitWarning, Drive, load_drive
from tests.validation.blind.protocols import full

FIRST_SEED = 1000
"""Seed of the first case; the plan itself uses small ones."""


def case(job: tuple[Plan, str, dict[str, float], int]) -> tuple[str, str, tuple[str, ...], float]:
    """(true effect, verdict, named effects, seconds) of one case; an empty name is no effect."""
    plan, name, parameters, seed = job
    warnings.simplefilter("ignore", DoesNotFitWarning)
    started = time.perf_counter()
    record = measured_record(plan.drive, plan.rig, plan.schedule, seed, {name: parameters} if name else {}, True)
    found = diagnose_record(record, drive=plan.drive)
    return name, found.verdict, tuple(e.name for e in found.effects), time.perf_counter() - started


def jobs(plan: Plan, count: int) -> list[tuple[Plan, str, dict[str, float], int]]:
    """Cases in turn over nothing and all effects of interest."""
    problem, fit = record_problem(plan.drive, measured_record(plan.drive, plan.rig, plan.schedule, 0))
    names = ["", *plan.interest]
    variants = {name: linearise(problem, name, fit) for name in plan.interest}
    made: list[tuple[Plan, str, dict[str, float], int]] = []
    for number in range(count):
        name, parameters = names[number % len(names)], {}
        if name:
            # A drift has no settling time, as in the plan.
            known = variants[name][-1:] if name == "torque_sensor_drift" else variants[name]
            values = draw_parameters(known, plan.sizes, FIRST_SEED + number)[0]
            parameters = {p.name: float(v) for p, v in zip(EFFECTS[name].parameters, values, strict=True)}
        made.append((plan, name, parameters, FIRST_SEED + number))
    return made


def compare_power(plan: Plan, count: int, workers: int) -> None:
    """Print predicted and observed frequencies of the right name."""
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        rows = []
        for done, row in enumerate(pool.map(case, jobs(plan, count)), 1):
            rows.append(row)
            name, verdict, named, seconds = row
            print(f"{done:4d}/{count}  {name or 'nothing':28s} {verdict:12s} {', '.join(named):40s} {seconds:5.1f} s")
    found, total, predicted_total = plan.isolability, 0, 0.0
    print(f"\n{'true':28s} {'cases':>5s} {'predicted':>9s} {'observed':>8s}")
    for k, true in enumerate(["", *found.true]):
        of_effect = [(verdict, named) for name, verdict, named, _ in rows if name == true]
        if not of_effect:
            continue
        column = found.names.index(true) if true else -1
        predicted = float(found.matrix[k, column])
        right = sum(named == (true,) and verdict == "named" if true else not named for verdict, named in of_effect)
        total, predicted_total = total + right, predicted_total + predicted * len(of_effect)
        print(f"{true or 'nothing':28s} {len(of_effect):5d} {predicted:9.2f} {right / len(of_effect):8.2f}")
    print(f"{'all':28s} {len(rows):5d} {predicted_total / len(rows):9.2f} {total / len(rows):8.2f}")


def hand_made(drive: Drive, plan: Plan) -> Schedule:
    """The full protocol of the blind catalogue with the times between runs and for heating of the rig.

    Loads become the twists of the mean drive; a run that warms up has its mean temperature.
    """
    from reefmu.model.contacts.tables import cached_lookup

    test, lookup = full(np.random.default_rng(0), abs(int(drive.ratio))), cached_lookup(drive)
    twist = np.linspace(-drive.max_twist, drive.max_twist, 801)
    torque = np.asarray(lookup.torque(twist))
    pieces: list[Piece] = []
    edges = test.starts
    for first, last in itertools.pairwise(edges):
        run = slice(int(first), int(last))
        temperature = float(test.temperature[run].mean())
        warm = temperature > 25
        step = np.diff(test.time[run])
        pieces.append(
            Piece(
                f"run {len(pieces) + 1} of the full protocol",
                "warm" if warm else "cold",
                np.concatenate([step[:1], step]),
                test.crank[run],
                np.interp(test.load[run] * lookup.full_torque, torque, twist),
                temperature if warm else 20.0,
            )
        )
    return make_schedule(pieces, range(len(pieces)), plan.rig)


def predicted(drive: Drive, plan: Plan, schedule: Schedule) -> PredictedIsolability:
    """The isolability of the plan's effects along another schedule, as that of the plan along its own."""
    setting = prepare_setting(drive, plan.rig, None, lambda stage, share: None)
    sets = [(name,) for name in plan.interest]
    return check_schedule(setting, schedule, sets, [(name,) for name in plan.isolability.names]).isolability


def compare_time(drive: Drive, plan: Plan) -> None:
    """Print rig time and predicted naming of the plan and of the hand-made protocol."""
    schedule = hand_made(drive, plan)
    other = predicted(drive, plan, schedule)
    print(f"\n{'predicted naming':28s} {'plan':>6s} {'by hand':>8s}")
    for name in plan.interest:
        print(f"{name:28s} {plan.isolability.named_right(name):6.2f} {other.named_right(name):8.2f}")
    means = [np.mean([found.named_right(name) for name in plan.interest]) for found in (plan.isolability, other)]
    print(f"{'mean':28s} {means[0]:6.2f} {means[1]:8.2f}")
    print(f"{'minutes on the rig':28s} {plan.seconds / 60:6.1f} {schedule.seconds / 60:8.1f}")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=200, help="simulated diagnoses (default 200)")
    parser.add_argument("--drive", default="drive_1")
    parser.add_argument("--rig", help="RIG.toml; default: a rig that can run the full protocol too")
    parser.add_argument("--effects", help="effects of interest, comma-separated (default: all)")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore", DoesNotFitWarning)
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")
    drive = load_drive(options.drive)
    rig = replace(Rig(), speed=150.0) if options.rig is None else load_rig(options.rig)
    effects = options.effects.split(",") if options.effects else None
    started = time.perf_counter()
    plan = make_plan(drive, rig, effects)
    print(f"planned in {time.perf_counter() - started:.1f} s: {len(plan.schedule)} runs, {plan.seconds / 60:.1f} min")
    if rig.can_turn:
        compare_time(drive, plan)
    if options.cases:
        compare_power(plan, options.cases, options.workers)


if __name__ == "__main__":
    main()
