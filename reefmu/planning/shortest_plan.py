"""The plan: from a drawing, a rig and the effects of interest to the shortest protocol that separates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.predicted_isolability import SIZES, PredictedIsolability
from ..diagnosis.random_effects.tolerance_scatter import Spread, in_turn
from ..effects import EFFECTS, find_effect
from ..model.contacts.tables import cached_lookup
from .checked_choice import Ended, choose_protocol
from .diagnosis_link import excluded_effects
from .protocols.rig import Rig
from .protocols.schedule import Schedule
from .remedies import Remedy, find_remedies
from .setting import Progress, check_schedule, prepare_setting

POWER = 0.9
"""Probability of the right name that a plan aims at. Chosen by judgement, usual for the power of a test."""


@dataclass(frozen=True)
class Plan:
    """A planned protocol and what it would tell.

    drive: name; rig: with torque and noise stated; schedule; isolability: under the diagnosis' whole covariance along
    the protocol; sizes: typical sizes, SI, by `effect.parameter`; interest: effects of interest; excluded: those that
    the rig's columns do not allow, with the reason; remedies: what cannot be told; torque: (n,) N.m, mean torque at the
    set points; ended: why it has no more runs; power: probability that was aimed at.
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
    ended: Ended
    power: float = POWER

    @property
    def seconds(self) -> float:
        """Duration of the protocol, s."""
        return self.schedule.seconds


def make_plan(
    drive: Drive,
    rig: Rig | None = None,
    effects: Sequence[str] | None = None,
    progress: Progress | None = None,
    spread: Spread = in_turn,
) -> Plan:
    """Plan a protocol.

    drive: the drawing of the drive; rig: what the rig can do, a usual one if None; effects: of interest, all if None;
    progress: called with the present stage and the share done; spread: shares the work among processes, with the same
    result. Raises `UnknownNameError` for an unknown effect, and `InputError` where none of the effects can be shown
    with the columns that the rig measures.
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
    check = partial(check_schedule, setting, true=sets, rivals=rivals, spread=spread)
    chosen = choose_protocol(candidates, check, report, POWER)
    report("sensors and motions that are missing", 0.9)
    other = partial(setting.candidates, true=sets, rivals=rivals)
    remedies = find_remedies(candidates, other, chosen, POWER)
    found = check(chosen.schedule, sizes=SIZES).isolability
    torque = cached_lookup(drive).torque(np.concatenate([p.twist for p in chosen.schedule.pieces]))
    return Plan(
        drive,
        rig,
        chosen.schedule,
        found,
        setting.sizes,
        interest,
        excluded,
        tuple(remedies),
        np.asarray(torque),
        chosen.ended,
    )
