"""The plan: from a drawing, a rig and the effects of interest to the shortest protocol that separates them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.effect_columns import Sensitivities, individual_information, sensitivities
from ..diagnosis.discrimination.predicted_isolability import PredictedIsolability, isolability, mean_isolability
from ..diagnosis.discrimination.rival_hypotheses import make_hypotheses
from ..diagnosis.probabilities.typical_sizes import typical_sizes
from ..effects import EFFECTS, find_effect
from ..model.contacts.tables import cached_lookup
from .design import MARGINS, Candidates, ProtocolDesign, design, make_targets, potential, wanted_separations
from .diagnosis_link import excluded_effects, record_problem
from .information import piece_information, record_information, total_information
from .protocols.motion_pieces import Piece, feasible, motion_library
from .protocols.rig import Rig, rig_noise
from .protocols.schedule import Schedule, has_individuals, make_schedule, measured_record
from .remedies import Remedy, find_remedies

POWER = 0.9
"""Probability of the right name that a plan aims at. Chosen by judgement, usual for the power of a test."""
LIBRARY_SEED, PROTOCOL_SEEDS = 1, (2, 3)
"""Seeds of the library's record, which is one of the mean drive, and of the protocol's records, which are of individual
drives. The diagnosis estimates noise and scatter in each; chosen by judgement for a time of some seconds."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Plan:
    """A planned protocol and what it would tell.

    drive: name; rig: with torque and noise stated; schedule; isolability: under the diagnosis' whole covariance along
    the protocol; sizes: typical sizes, SI, by `effect.parameter`; interest: effects of interest; excluded: those that
    the rig's columns do not allow, with the reason; remedies: what cannot be told; torque: (n,) N.m, mean torque at the
    set points; power: probability that was aimed at.
    """

    drive: Drive
    rig: Rig
    schedule: Schedule
    isolability: PredictedIsolability
    sizes: Mapping[str, float]
    interest: tuple[str, ...]
    excluded: Mapping[str, str]
    remedies: tuple[Remedy, ...]
    torque: Array
    power: float = POWER

    @property
    def seconds(self) -> float:
        """Duration of the protocol, s."""
        return self.schedule.seconds


@dataclass(frozen=True)
class Setting:
    """The library of a drive on a rig, and the sensitivities along all of it."""

    drive: Drive
    rig: Rig
    library: list[Piece]
    whole: Schedule
    columns: Sensitivities
    sizes: Mapping[str, float]

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
    problem, fit = record_problem(drive, measured_record(drive, complete, whole, LIBRARY_SEED))
    report("sensitivities", 0.2)
    return Setting(drive, rig, library, whole, sensitivities(problem, fit, sizes, names), sizes)


def make_plan(
    drive: Drive,
    rig: Rig | None = None,
    effects: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Plan a protocol.

    drive: the drawing of the drive; rig: what the rig can do, a usual one if None; effects: of interest, all if None;
    progress: called with the present stage and the share done. Raises `UnknownNameError` for an unknown effect, and
    `InputError` where none of the effects can be shown with the columns that the rig measures.
    """
    report: Progress = progress or (lambda stage, share: None)
    for name in effects or ():
        find_effect(name, "--effects")
    setting = prepare_setting(drive, rig or Rig(), None, report)
    rig = setting.rig
    excluded = excluded_effects(rig.missing)
    rivals = [(name,) for name in EFFECTS if name not in excluded]
    interest = tuple(name for name in EFFECTS if (effects is None or name in effects) and name not in excluded)
    if not interest:
        reasons = "; ".join(f"{name}: {excluded[name]}" for name in effects or ())
        raise InputError(f"--effects: expected an effect that the rig's columns can show, got {reasons}")
    sets = [(name,) for name in interest]
    candidates = setting.candidates(rig, sets, rivals)
    chosen = choose_pieces(candidates, report)
    report("predicted probabilities", 0.6)
    found = _predict(setting, chosen.schedule, sets, rivals)
    report("sensors and motions that are missing", 0.9)
    other = partial(setting.candidates, true=sets, rivals=rivals)
    remedies = find_remedies(candidates, other, found, chosen.schedule, POWER)
    torque = cached_lookup(drive).torque(np.concatenate([p.twist for p in chosen.schedule.pieces]))
    return Plan(
        drive, rig, chosen.schedule, found, setting.sizes, interest, excluded, tuple(remedies), np.asarray(torque)
    )


def _predict(
    setting: Setting, schedule: Schedule, true: Sequence[Sequence[str]], rivals: Sequence[Sequence[str]]
) -> PredictedIsolability:
    """The isolability along a schedule, mean over `PROTOCOL_SEEDS` records of individual drives, each under the whole
    covariance that the diagnosis has for it.

    A drawing of compliant bodies has no individuals; its record is one of the mean drive, with the scatter of the
    diagnosis and the noise of the rig.
    """
    drive, rig = setting.drive, setting.rig
    found: list[PredictedIsolability] = []
    for seed in PROTOCOL_SEEDS:
        own = has_individuals(drive)
        columns = sensitivities(
            *record_problem(drive, measured_record(drive, rig, schedule, seed, individual=own)), setting.sizes
        )
        noise = rig_noise(rig, drive.ratio)
        information = individual_information(columns) if own else record_information(columns, noise)
        found.append(
            isolability(information, make_hypotheses(columns, true), make_hypotheses(columns, rivals), seed=seed)
        )
    return mean_isolability(found)


def choose_pieces(candidates: Candidates, report: Progress) -> ProtocolDesign:
    """The design whose predicted probabilities reach `POWER` for what all pieces together separate."""
    allowed = feasible(candidates.library)
    everything = potential(candidates, allowed)
    seconds, chosen = 60 * candidates.rig.minutes, None
    for k, margin in enumerate(MARGINS):
        targets = make_targets(everything, wanted_separations(POWER, margin))
        done = 0.25 + 0.1 * k
        chosen = design(
            candidates,
            allowed,
            targets,
            seconds,
            start=chosen.schedule.chosen if chosen else (),
            progress=lambda share, start=done: report("choice of motions", start + 0.1 * share),
        )
        information = total_information(candidates.pieces, chosen.schedule)
        predicted = isolability(information, candidates.true, candidates.rivals, sizes=(), draws=(100, 0))
        separable = [bool(part.mean(axis=0).min() > 0.99) for part in _apart(chosen, candidates)]
        named = [predicted.named_right(h.label) for h in candidates.true]
        if all(right >= POWER for right, apart in zip(named, separable, strict=True) if apart):
            break
    assert chosen is not None
    return chosen


def _apart(chosen: ProtocolDesign, candidates: Candidates) -> list[NDArray[np.bool_]]:
    """(d, r) whether the pairs of every true hypothesis are possible, without its own column."""
    rivals = [None, *(h.names for h in candidates.rivals)]
    return [
        np.delete(part, [j for j, names in enumerate(rivals) if names == h.names], axis=1)
        for part, h in zip(chosen.targets.possible, candidates.true, strict=True)
    ]
