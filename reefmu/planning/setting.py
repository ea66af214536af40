"""The library of a drive on a rig, linearised once, and what a protocol of its pieces would name when it is checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.effect_columns import Sensitivities, linear_in_time, sensitivities
from ..diagnosis.discrimination.predicted_isolability import PredictedIsolability, isolability, mean_isolability
from ..diagnosis.discrimination.rival_hypotheses import make_hypotheses, separations
from ..diagnosis.discrimination.simulated_scores import gaussian_scores, scores_of_records
from ..diagnosis.estimation.least_squares import Fit
from ..diagnosis.estimation.problem import SEARCH_BLOCKS, Problem
from ..diagnosis.inference.dispersion import dispersion
from ..diagnosis.preparation import with_individuals
from ..diagnosis.probabilities.typical_sizes import typical_sizes
from ..diagnosis.random_effects.tolerance_scatter import Spread, in_turn
from ..model.contacts.tables import cached_lookup
from ..record import Record
from .design import Candidates
from .diagnosis_link import problems_of_records, record_problem
from .information import piece_information, record_information
from .protocols.motion_pieces import Piece, motion_library
from .protocols.rig import Rig, RigNoise, rig_noise
from .protocols.schedule import Schedule, has_individuals, make_schedule, measured_record

LIBRARY_SEED, PROTOCOL_SEEDS = 1, (2, 3, 4, 5)
"""Seeds of the library's record, which is one of the mean drive, and of the protocol's records, which are of individual
drives. The diagnosis estimates noise and scatter in each; chosen by judgement for a time of some seconds."""

LIBRARY_BLOCKS = round(1.2 * SEARCH_BLOCKS)
"""Approximate number of blocks of the library's record, which holds every motion; chosen by judgement, so that a block
is hardly longer than those of a protocol's record."""
DRAWS = 50
"""Records that are simulated along each of them. The standard error of a probability is then below 4 percentage
points, besides what those records have in common."""
N_INDIVIDUALS = 16
"""Individual drives that are simulated along each of them; chosen by judgement, four times as many in all."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Checked:
    """What records of individual drives along a protocol would name; separations: for every true hypothesis (d, r + 1),
    as `rival_hypotheses.separations`, mean over the records.
    """

    isolability: PredictedIsolability
    separations: tuple[Array, ...]

    def named_right(self) -> list[float]:
        """Probability of the right name of every true hypothesis at its typical size."""
        return [self.isolability.named_right(label) for label in self.isolability.true]


@dataclass(frozen=True)
class Setting:
    """The library of a drive on a rig, and the sensitivities along all of it; names: of the effects, None for all."""

    drive: Drive
    rig: Rig
    library: list[Piece]
    whole: Schedule
    columns: Sensitivities
    sizes: Mapping[str, float]
    names: Sequence[str] | None = None

    def candidates(self, rig: Rig, true: Sequence[Sequence[str]], rivals: Sequence[Sequence[str]]) -> Candidates:
        """The candidates with the noise of a rig that performs the same motions."""
        information = piece_information(self.columns, self.whole, rig_noise(rig, self.drive.ratio))
        return Candidates(
            information,
            self.library,
            rig,
            make_hypotheses(self.columns, true),
            make_hypotheses(self.columns, rivals),
        )


def prepare_setting(drive: Drive, rig: Rig, names: Sequence[str] | None, report: Progress) -> Setting:
    """The library of the drive on the rig, linearised for the effects `names` or for all."""
    lookup = cached_lookup(drive)
    rig = rig.for_drive(lookup.full_torque)
    assert rig.torque is not None
    twist = np.linspace(0, drive.max_twist, 400)
    top = float(np.interp(rig.torque, lookup.torque(twist), twist))
    library = motion_library(rig, top, drive.max_twist)
    whole = make_schedule(library, range(len(library)), rig)
    report("record of all motions", 0.05)
    clearance = drive.tolerances["gear"].sigma
    sizes = typical_sizes(lookup.full_torque, drive.max_twist, 60 * rig.minutes, clearance, drive.transmission_ratio)
    # All columns are present: what a rig does not measure only excludes effects from its candidates. Without noise of
    # the angles, effects that a motion makes equal have equal traces; information counts the noise of the rig.
    complete = replace(
        rig,
        crank="turns",
        crank_measured=True,
        temperature_measured=True,
        output_noise=0.0,
        output_resolution=0.0,
        crank_noise=0.0,
        crank_resolution=0.0,
    )
    problem, fit = record_problem(drive, measured_record(drive, complete, whole, LIBRARY_SEED), LIBRARY_BLOCKS)
    report("sensitivities", 0.2)
    columns = linear_in_time(sensitivities(problem, fit, sizes, names))
    return Setting(drive, rig, library, whole, columns, sizes, names)


def check_schedule(
    setting: Setting,
    schedule: Schedule,
    true: Sequence[Sequence[str]],
    rivals: Sequence[Sequence[str]],
    sizes: Sequence[float] = (),
    spread: Spread = in_turn,
) -> Checked:
    """What the diagnosis would name along a schedule, mean over `PROTOCOL_SEEDS` records of individual drives, each
    under the whole covariance that the diagnosis has for it.

    sizes: over the typical ones, at which the probability of the right name is computed beside these; spread: shares
    the records among processes, with the same result. A drawing of compliant bodies has no individuals; its record is
    one of the mean drive, with the scatter of the diagnosis and the noise of the rig.
    """
    drive, rig = setting.drive, setting.rig
    own = has_individuals(drive)
    records = [*spread(_measured, [(drive, rig, schedule, seed, own) for seed in PROTOCOL_SEEDS])]
    problems = problems_of_records(drive, records, spread=spread)
    noise = None if own else rig_noise(rig, drive.ratio)
    jobs = [
        _OneRecord(*both, seed, noise, setting.sizes, setting.names, true, rivals, sizes)
        for seed, both in zip(PROTOCOL_SEEDS, problems, strict=True)
    ]
    found, apart = zip(*spread(_named_along, jobs), strict=True)
    return Checked(mean_isolability(found), tuple(np.mean(parts, axis=0) for parts in zip(*apart, strict=True)))


def _measured(job: tuple[Drive, Rig, Schedule, int, bool]) -> Record:
    drive, rig, schedule, seed, individual = job
    return measured_record(drive, rig, schedule, seed, individual=individual)


@dataclass(frozen=True)
class _OneRecord:
    """problem, fit: of one record, without effects; noise: of the rig, None for records of individuals; typical: sizes
    of effects; names: as in `Setting`; true, rivals, sizes: as in `check_schedule`."""

    problem: Problem
    fit: Fit
    seed: int
    noise: RigNoise | None
    typical: Mapping[str, float]
    names: Sequence[str] | None
    true: Sequence[Sequence[str]]
    rivals: Sequence[Sequence[str]]
    sizes: Sequence[float]


def _named_along(job: _OneRecord) -> tuple[PredictedIsolability, list[Array]]:
    """What the diagnosis would name along one record, and the separations there."""
    columns = sensitivities(with_individuals(job.problem, N_INDIVIDUALS), job.fit, job.typical, job.names)
    if job.noise is None:
        divided = dispersion(job.problem, [(job.fit, None)])
        simulated = scores_of_records(columns, job.fit.weighting, DRAWS, job.seed, divided)
    else:
        simulated = gaussian_scores(record_information(columns, job.noise), DRAWS, job.seed)
    sets = make_hypotheses(columns, job.true), make_hypotheses(columns, job.rivals)
    return isolability(simulated, *sets, job.sizes), separations(simulated.information, *sets)
