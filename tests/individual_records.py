"""Records of simulated individuals, at a twist or a torque that the rig holds."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import cache

import numpy as np

from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_motion import element_motion
from reefmu.diagnosis.random_effects.individuals import simulate_individuals
from reefmu.diagnosis.random_effects.responses import element_responses
from reefmu.diagnosis.random_effects.scatter import Scatter
from reefmu.record import Record
from stiffness_model import DoesNotFitWarning, Drive, load_drive
from stiffness_model.lookup.build_lookup import build_lookup
from stiffness_model.lookup.table import Lookup
from tests import diagnosis_rig as rig


def seated_drive(per_row: int) -> Drive:
    """drive_1 with so many elements in a row of 29 seats."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoesNotFitWarning)
        return load_drive("drive_1", elements=3 * per_row)


@cache
def mean_lookup(drive: Drive) -> Lookup:
    """Of few drives: the diagnosis takes the mean torque alone, which does not depend on them."""
    return build_lookup(drive, n_drives=16)


def record_of_individual(drive: Drive, late: float = 0.0, noise: float = 0.3) -> Record:
    """The record of an individual.

    late: s, by which the torque is read later than the angles; noise: N.m, of the torque.
    """
    record = rig.protocol()
    runs = np.split(np.arange(len(record)), record.starts[1:])
    crank, output = (
        np.concatenate([np.interp(record.time[r] - late, record.time[r], angle[r]) for r in runs])
        for angle in (record.crank_angle, record.output_angle)
    )
    trace = make_trace(replace(record, crank_angle=crank, output_angle=output), drive.ratio)
    motion = element_motion(drive, trace, make_blocks(trace, 1))
    scatter = Scatter(drive, element_responses(drive), motion, trace.twist)
    (own,) = simulate_individuals(scatter, 1, seed=4, places=(0.0, 0.0))
    added = noise * np.random.default_rng(0).standard_normal(len(record))
    return replace(record, output_torque=mean_lookup(drive).torque(trace.twist) + own + added)


def problem_of_individual(per_row: int) -> Problem:
    """The problem of an individual without effects, with so many elements in a row of 29 seats."""
    drive = seated_drive(per_row)
    record = record_of_individual(drive)
    trace = make_trace(record, drive.ratio)
    return prepare_problem(record, trace, BaseCurveSource(drive).base_curve(trace))


def record_at_held_torque(drive: Drive, late: float) -> Record:
    """The same of a rig that drives the torque, so that the twist gives way while elements pass; noise: 0.3 N.m."""
    record, lookup = rig.protocol(), mean_lookup(drive)
    wanted = lookup.torque(record.twist(drive.ratio))
    for _ in range(4):
        trace = make_trace(record, drive.ratio)
        motion = element_motion(drive, trace, make_blocks(trace, 1))
        scatter = Scatter(drive, element_responses(drive), motion, trace.twist)
        (own,) = simulate_individuals(scatter, 1, seed=4, places=(0.0, 0.0))
        torque, step = lookup.torque(trace.twist) + own, 1e-3 * drive.max_twist
        stiffness = (lookup.torque(trace.twist + step) - lookup.torque(trace.twist - step)) / (2 * step)
        twist = trace.twist - (torque - wanted) / stiffness
        record = replace(record, output_angle=record.crank_angle / drive.ratio - twist)
    read = [
        np.interp(record.time[r] - late, record.time[r], torque[r])
        for r in np.split(np.arange(len(record)), record.starts[1:])
    ]
    noise = 0.3 * np.random.default_rng(0).standard_normal(len(record))
    return replace(record, output_torque=np.concatenate(read) + noise)
