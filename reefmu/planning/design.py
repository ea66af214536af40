"""The shortest choice of motion pieces that separates the effects of interest: greedy selection, then exchange.

Criterion: mean over the pairs of a true effect and a rival of min(1, separation over the wanted one), a truncated
T-criterion. It is increasing in the pieces, and the piece with the largest gain per second is taken next, which for
submodular criteria is near the optimum (Krause, McMahan, Guestrin and Gupta, Robust Submodular Observation Selection,
2008). Pieces that the others made dispensable are removed again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logit, ndtri

from stiffness_model.numerics.arrays import Array

from ..diagnosis.calibrated_odds import CALIBRATED, NAMED, least_evidence
from ..diagnosis.discrimination.effect_columns import AMPLITUDE_DEVIATION
from ..diagnosis.discrimination.rival_hypotheses import RivalHypothesis, separations
from .information import PieceInformation, summed_products, total_information
from .protocols.motion_pieces import Piece
from .protocols.rig import Rig
from .protocols.schedule import Schedule, make_schedule

MAX_COPIES = 3
"""Copies of one piece that a protocol may hold. Chosen by judgement: further ones bring the same scatter."""
WORTHWHILE = 0.02
"""Gain, over the target of one pair of effects, below which a piece is added only where no other one gains more. Chosen
by judgement: a protocol would hold fifty such pieces before one pair is separated."""
NEGLIGIBLE = 3e-4
"""Change of the criterion, whose greatest value is 1, for which no piece is added and a chosen one is removed. Chosen
by judgement: a tenth of what one pair of 17 effects contributes."""
OCCAM = math.log(10 * AMPLITUDE_DEVIATION) + 0.5 / AMPLITUDE_DEVIATION**2
"""What one amplitude of typical size at the limit of detection, 10 deviations, costs in log evidence: the logarithm of
prior over posterior width, and the fall of the prior from its middle."""


@dataclass(frozen=True)
class Targets:
    """wanted: squared separations for every true hypothesis (d, r + 1), from nothing and from every rival; possible:
    likewise, whether all pieces of the rig together reach what a name takes; only these pairs count.
    """

    wanted: tuple[Array, ...]
    possible: tuple[NDArray[np.bool_], ...]

    def share(self, found: Sequence[Array]) -> float:
        """Mean over the possible pairs of min(1, separation over the wanted one); 1 without any such pair."""
        total = count = 0.0
        for part, wanted, mask in zip(found, self.wanted, self.possible, strict=True):
            total, count = total + float((np.minimum(part / wanted, 1.0) * mask).sum()), count + float(mask.sum())
        return total / count if count else 1.0

    @property
    def worthwhile(self) -> float:
        """Gain of the criterion that is `WORTHWHILE` of one pair, over all its traces."""
        pairs = sum(float(mask.mean(axis=0).sum()) for mask in self.possible)
        return max(WORTHWHILE / max(pairs, 1.0), NEGLIGIBLE)


def wanted_separations(power: float) -> tuple[float, float]:
    """Squared separations, from nothing and from a rival, at which an effect is named with this probability.

    The log Bayes factor of two simple hypotheses at a squared separation q is Gaussian with mean q/2 and variance q; it
    must exceed what the calibrated odds of a name take, with the probability `power`.

    >>> [round(q, 1) for q in wanted_separations(0.9)]
    [27.2, 8.1]
    """
    z = float(ndtri(power))
    odds = float(logit(NAMED))
    thresholds = (least_evidence(odds - CALIBRATED.first_effect) + OCCAM, least_evidence(odds))
    against_nothing, against_rival = ((z + np.sqrt(z**2 + 2 * t)) ** 2 for t in thresholds)
    return float(against_nothing), float(against_rival)


@dataclass(frozen=True)
class ProtocolDesign:
    """schedule: of the chosen pieces; share: criterion that it reaches, 1 for all possible pairs; targets."""

    schedule: Schedule
    share: float
    targets: Targets


@dataclass(frozen=True)
class Candidates:
    """What a protocol is chosen for: hypotheses that may be true and their rivals, over the pieces of a library."""

    pieces: PieceInformation
    library: Sequence[Piece]
    rig: Rig
    true: Sequence[RivalHypothesis]
    rivals: Sequence[RivalHypothesis]

    def found(self, chosen: Sequence[int]) -> tuple[Schedule, list[Array]]:
        """The schedule of the pieces and the separations along it."""
        schedule = self.schedule(chosen)
        return schedule, self.separations(schedule)

    def schedule(self, chosen: Sequence[int]) -> Schedule:
        """The pieces in the order in which this rig runs them."""
        return make_schedule(self.library, chosen, self.rig)

    def separations(self, schedule: Schedule, summed: Array | None = None) -> list[Array]:
        """The separations along a schedule of pieces of the library; summed: see `total_information`."""
        return separations(total_information(self.pieces, schedule, summed), self.true, self.rivals)


def potential(candidates: Candidates, allowed: Sequence[int]) -> list[Array]:
    """Separations along all allowed pieces with all their copies: what no protocol of them exceeds by much."""
    return candidates.found(list(allowed) * MAX_COPIES)[1]


def make_targets(everything: Sequence[Array], power: float, factors: Sequence[Array] | None = None) -> Targets:
    """The targets of pairs that the separations `everything`, of all pieces together, reach.

    factors: on the separations that a name takes, for every true hypothesis (d, r + 1), 1 if None; no target exceeds
    what all pieces reach.
    """
    nothing, rival = wanted_separations(power)
    takes = [np.broadcast_to([nothing, *[rival] * (part.shape[1] - 1)], part.shape) for part in everything]
    more = takes if factors is None else [t * f for t, f in zip(takes, factors, strict=True)]
    return Targets(
        tuple(np.maximum(np.minimum(m, part), t) for m, part, t in zip(more, everything, takes, strict=True)),
        tuple(part >= t for part, t in zip(everything, takes, strict=True)),
    )


def design(
    candidates: Candidates,
    allowed: Sequence[int],
    targets: Targets,
    seconds: float,
    start: Sequence[int] = (),
    progress: Callable[[float], None] | None = None,
) -> ProtocolDesign:
    """A short protocol of the pieces `allowed` that reaches the targets as far as `seconds` allow.

    start: pieces to begin with; progress: called with the share of the criterion that is reached.
    """
    chosen = list(start)
    share = targets.share(candidates.found(chosen)[1]) if chosen else 0.0
    while share < 1 - 1e-9:
        best = best_addition(candidates, allowed, targets, seconds, chosen, share)
        if best is None:
            break
        share, added = best
        chosen.append(added)
        if progress:
            progress(share)
    chosen = _without_dispensable(candidates, targets, chosen, share)
    if not chosen:
        # Nothing is separable: the shortest reading keeps the protocol valid.
        chosen = [min(allowed, key=lambda k: candidates.library[k].seconds)]
    schedule, found = candidates.found(chosen)
    return ProtocolDesign(schedule, targets.share(found), targets)


def best_addition(
    candidates: Candidates,
    allowed: Sequence[int],
    targets: Targets,
    seconds: float,
    chosen: list[int],
    share: float,
) -> tuple[float, int] | None:
    """The criterion with the piece of the largest gain per second, and that piece; None where every gain is negligible.

    Pieces whose gain is worthwhile come first: many short ones with small gains would take the time of a few.
    """
    now = candidates.schedule(chosen).seconds if chosen else 0.0
    summed = summed_products(candidates.pieces, chosen)
    best, rank = None, (False, 0.0)
    for index in allowed:
        if chosen.count(index) >= MAX_COPIES:
            continue
        schedule = candidates.schedule([*chosen, index])
        if schedule.seconds > seconds:
            continue
        with_it = summed + summed_products(candidates.pieces, [index])
        reached = targets.share(candidates.separations(schedule, with_it))
        gain = reached - share
        own = gain > targets.worthwhile, gain / max(schedule.seconds - now, 1.0)
        if gain > NEGLIGIBLE and own > rank:
            best, rank = (reached, index), own
    return best


def _without_dispensable(candidates: Candidates, targets: Targets, chosen: list[int], share: float) -> list[int]:
    """The pieces without those, longest first, whose removal costs a negligible part of the criterion."""
    kept = list(chosen)
    for index in sorted(chosen, key=lambda k: -candidates.library[k].seconds):
        rest = list(kept)
        rest.remove(index)
        if rest and targets.share(candidates.found(rest)[1]) >= min(share, 1.0) - NEGLIGIBLE:
            kept = rest
    return kept
