"""The next experiment of a diagnosis: the shortest protocol that tells rival sets of effects apart on the same rig."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.effect_columns import ACCUMULATING
from ..diagnosis.random_effects.tolerance_scatter import Spread, in_turn
from ..record import Record
from .checked_choice import choose_protocol
from .diagnosis_link import excluded_effects
from .protocols.rig import Rig
from .protocols.schedule import Schedule
from .setting import check_schedule, prepare_setting
from .shortest_plan import POWER

MIN_TURN = 0.1
"""rad, range of the crank angle within a run from which the crank turns, and between runs from which its angle can be
set. Chosen by judgement, above the noise of encoders and far below an element's passing."""
MIN_WARMING = 5.0
"""K, range of the temperature from which a rig heats the drive. Chosen by judgement, above the changes of a room."""
MINUTES = 60.0
"""Minutes that a next experiment may take. Chosen by judgement."""


@dataclass(frozen=True)
class NextProtocol:
    """schedule: the best next protocol; labels: of the rival sets; probability: (s, s + 1), to name the set of a
    column, or none (last column), while that of a row is true; told_apart: mean probability of the right name.
    """

    schedule: Schedule
    labels: tuple[str, ...]
    probability: Array
    told_apart: float


def next_protocol(
    drive: Drive, rig: Rig, rival_sets: Sequence[Sequence[str]], spread: Spread = in_turn
) -> NextProtocol:
    """The shortest protocol that tells rival sets of effects apart, and the probability that it does.

    rig: that of the record which does not decide between the sets (`rig_of_record`). Effects have their typical sizes.
    spread: shares the work among processes, with the same result.
    Raises `InputError` for fewer than two sets that the rig's columns can show.
    """

    def silent(_stage: str, _share: float) -> None:
        """No progress is shown."""

    excluded = excluded_effects(rig.missing)
    shown = [tuple(names) for names in rival_sets if names and not set(names) & set(excluded)]
    if len(shown) < 2:
        raise InputError(f"next protocol: expected two sets of effects that the rig can show, got {rival_sets!r}")
    names = {name for names in shown for name in names} | set(ACCUMULATING.values())
    setting = prepare_setting(drive, rig, sorted(names), silent)
    check = partial(check_schedule, setting, true=shown, rivals=shown, spread=spread)
    chosen = choose_protocol(setting.candidates(setting.rig, shown, shown), check, silent, POWER)
    found = chosen.checked.isolability
    return NextProtocol(
        chosen.schedule,
        found.names,
        found.matrix[1:],
        float(np.mean([found.named_right(label) for label in found.true])),
    )


def rig_of_record(record: Record, ratio: float, torque_noise: float, twist_noise: float) -> Rig:
    """The rig that a record shows: greatest torque and speed, what moved, temperatures, noise and sampling rate.

    ratio: of the gear, signed; torque_noise: N.m, and twist_noise: rad, standard deviations of single samples.
    """
    edges = [*record.starts.tolist(), len(record)]
    runs = [slice(a, b) for a, b in itertools.pairwise(edges)]
    crank = record.crank_angle
    turning = [run for run in runs if np.ptp(crank[run]) > MIN_TURN]
    steps = np.concatenate([np.diff(record.time[run]) for run in runs])
    steps = steps[steps > 0]
    speeds = [float(np.ptp(crank[run]) / max(np.ptp(record.time[run]), 1e-9)) for run in turning]
    warm = float(np.ptp(record.temperature)) > MIN_WARMING and "temperature" not in record.missing
    rig = Rig(
        name="rig of the record",
        minutes=MINUTES,
        torque=float(np.abs(record.output_torque).max()),
        crank="turns" if turning else "angles" if np.ptp(crank) > MIN_TURN else "locked",
        speed=max(speeds, default=0.0),
        temperature_measured="temperature" not in record.missing,
        crank_measured="crank_angle" not in record.missing,
        sample_rate=1 / float(np.median(steps)) if steps.size else Rig().sample_rate,
        torque_noise=max(torque_noise, 1e-9),
        # The diagnosis estimates the noise of the twist as a whole.
        output_noise=twist_noise,
        crank_noise=0.0,
    )
    temperature = float(record.temperature.max()) if warm else rig.lowest
    return replace(rig, highest=max(temperature, rig.lowest))
