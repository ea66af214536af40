"""The choice of motions, checked on records of individual drives and extended until it holds there.

The information of the library is that of the mean drive with the noise of the rig. The diagnosis estimates the noise in
the record itself, and a short record of an individual drive shows it less well. Where the records name an effect too
rarely, its targets are raised by what the library's information promised and the records do not hold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from stiffness_model.numerics.arrays import Array

from .design import Candidates, Targets, best_addition, design, make_targets, potential
from .protocols.motion_pieces import feasible
from .protocols.schedule import Schedule
from .setting import Checked, Progress

MAX_ROUNDS = 6
"""Checks of one choice. Chosen by judgement to bound the time; the last one is of all that adds to the separations of
the effects that are named too rarely."""
MARGIN = 1.3
"""Factor on the targets of an effect that is named too rarely, besides what the records lack: targets are pairwise, a
name must beat all rivals at once. Chosen by judgement."""
LOSS = 0.03
"""Mean probability of the right name that a shorter protocol may lose. Chosen by judgement, below the standard error of
the predicted probability of one effect."""


class Ended(Enum):
    """Why a choice of motions ended; the value is that of plan.json."""

    REACHED = "reached"
    """Every effect is named with the wanted probability."""
    TIME = "time"
    """No further run that would help fits into the time."""
    NOTHING = "nothing helps"
    """No further run on the rig would bring the effects that are named too rarely to it, however long the protocol."""


@dataclass(frozen=True)
class Choice:
    """schedule: of the chosen pieces; checked: what records along it name; ended: why no more pieces were chosen."""

    schedule: Schedule
    checked: Checked
    ended: Ended


def choose_protocol(
    candidates: Candidates, check: Callable[[Schedule], Checked], report: Progress, power: float
) -> Choice:
    """The shortest protocol found along which every hypothesis is named with the probability `power`, as far as time
    and rig allow.

    check: what records along a schedule name; report: called with the stage and the share done, up to 0.9. Shorter
    times are tried, as long as they name as many and nearly as often: with less time, pieces that are long do not fit,
    and shorter ones are taken in their place. That is half of the time, and where that fails, between it and all of it.
    """
    found = whole = _choose(candidates, check, report, power, 60 * candidates.rig.minutes)
    too_short = 0.0
    while True:
        allowed = (too_short + found.schedule.seconds) / 2
        shorter = _choose(candidates, check, report, power, allowed)
        # A protocol has at least the shortest piece.
        if shorter.schedule.seconds < found.schedule.seconds and _names_as_well(shorter.checked, whole.checked, power):
            found = replace(shorter, ended=whole.ended)
        elif too_short:
            return found
        else:
            too_short = allowed


def _names_as_well(other: Checked, whole: Checked, power: float) -> bool:
    """Whether a shorter protocol names as many effects with the probability `power` as that of all the time, and nearly
    as often."""
    (count, total), (least_count, least_total) = _rank(other, power), _rank(whole, power)
    return count >= least_count and total >= least_total - LOSS * len(whole.isolability.true)


def _choose(
    candidates: Candidates,
    check: Callable[[Schedule], Checked],
    report: Progress,
    power: float,
    seconds: float,
) -> Choice:
    """The protocol for one duration, s."""
    allowed = feasible(candidates.library)
    everything = potential(candidates, allowed)
    factors = [np.ones(part.shape) for part in everything]
    targets = make_targets(everything, power, factors)
    separable = _separable(targets, candidates)
    best: tuple[Schedule, Checked] | None = None
    start: tuple[int, ...] = ()
    chosen = None
    for k in range(MAX_ROUNDS):
        begin, width = 0.25 + 0.65 * k / MAX_ROUNDS, 0.6 / MAX_ROUNDS
        chosen = design(
            candidates,
            allowed,
            targets,
            seconds,
            start,
            progress=lambda share, begin=begin, width=width: report("choice of motions", begin + 0.5 * width * share),
        )
        if best and sorted(chosen.schedule.chosen) == sorted(start):
            break
        report("predicted probabilities", begin + width)
        checked = check(chosen.schedule)
        if best is None or _rank(checked, power) > _rank(best[1], power):
            best = chosen.schedule, checked
        short = [right < power for right in checked.named_right()]
        raised = [lacks and apart for lacks, apart in zip(short, separable, strict=True)]
        if not any(raised):
            break
        factors = _raised(factors, candidates.found(chosen.schedule.chosen)[1], checked, raised)
        if k == MAX_ROUNDS - 2:
            factors = [np.full_like(f, np.inf) if lacks else f for f, lacks in zip(factors, raised, strict=True)]
        start, targets = chosen.schedule.chosen, make_targets(everything, power, factors)
    assert best is not None
    assert chosen is not None
    schedule, checked = best
    if min(checked.named_right()) >= power:
        return Choice(schedule, checked, Ended.REACHED)
    pieces = list(chosen.schedule.chosen)
    share = targets.share(candidates.found(pieces)[1])
    within, ever = (best_addition(candidates, allowed, targets, s, pieces, share) for s in (seconds, np.inf))
    return Choice(schedule, checked, Ended.TIME if ever and not within else Ended.NOTHING)


def _separable(targets: Targets, candidates: Candidates) -> list[bool]:
    """Whether all pieces of the rig together separate every trace of a true hypothesis from nothing and all rivals."""
    rivals = [None, *(h.names for h in candidates.rivals)]
    return [
        bool(part[:, [names != h.names for names in rivals]].all())
        for part, h in zip(targets.possible, candidates.true, strict=True)
    ]


def _rank(checked: Checked, power: float) -> tuple[int, float]:
    """Order of choices: effects that are named, then how nearly all of them are."""
    right = checked.named_right()
    return sum(p >= power for p in right), float(np.minimum(right, power).sum())


def _raised(
    factors: Sequence[Array], promised: Sequence[Array], checked: Checked, short: Sequence[bool]
) -> list[Array]:
    """Factors of the next round: of hypotheses that are named too rarely, those of the pairs that the records separate
    less than the information of the library promised are raised by that ratio, all by `MARGIN`."""
    return [
        factor * MARGIN * np.maximum(one / np.maximum(found, 1e-9), 1.0) if lacks else factor
        for factor, one, found, lacks in zip(factors, promised, checked.separations, short, strict=True)
    ]
