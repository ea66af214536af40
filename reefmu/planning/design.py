"""The shortest choice of motion pieces that separates the effects of interest: greedy selection, then exchange.

Criterion: mean over the pairs of a true effect and a rival of min(1, separation over the wanted one), a truncated
T-criterion. It is increasing in the pieces, and the piece with the largest gain per second is taken next, which for
submodular criteria is near the optimum (Krause, McMahan, Guestrin and Gupta, Robust Submodular Observation Selection,
2008). Pieces that the others made dispensable are removed again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.predicted_isolability import NAMED, PRIOR_ODDS
from ..diagnosis.discrimination.rival_hypotheses import RivalHypothesis, separations
from .information import PieceInformation, total_information
from .protocols.motion_pieces import Piece
from .protocols.rig import Rig
from .protocols.schedule import Schedule, make_schedule

MAX_COPIES = 3
"""Copies of one piece that a protocol may hold. Chosen by judgement: further ones bring the same scatter."""
MIN_GAIN = 3e-4
"""Gain of the criterion, over its greatest value, below which no further piece is added. Chosen by judgement: a tenth
of what one pair of 17 effects contributes."""
MARGINS = (1.0, 1.3, 1.7)
"""Factors on the wanted separations, tried in turn until the predicted probabilities reach the wanted power: the
separations are pairwise, a name must beat all rivals at once. Chosen by judgement."""
OCCAM = 2.0
"""Expected logarithm of prior over posterior width of one amplitude at the limit of detection, ln(5.4) rounded up."""


@dataclass(frozen=True)
class Targets:
    """wanted: squared separations from nothing and from a rival; possible: for every true hypothesis (d, r + 1) whether
    all pieces of the rig together reach them; only these pairs count.
    """

    wanted: tuple[float, float]
    possible: tuple[NDArray[np.bool_], ...]

    def share(self, found: Sequence[Array]) -> float:
        """Mean over the possible pairs of min(1, separation over the wanted one); 1 without any such pair."""
        total = count = 0.0
        for part, mask in zip(found, self.possible, strict=True):
            reached = np.minimum(part / self.scale(part.shape[1]), 1.0)
            total, count = total + float((reached * mask).sum()), count + float(mask.sum())
        return total / count if count else 1.0

    def scale(self, width: int) -> Array:
        """(width,) wanted separations of one row."""
        return np.array([self.wanted[0], *[self.wanted[1]] * (width - 1)])


def wanted_separations(power: float, margin: float = 1.0) -> tuple[float, float]:
    """Squared separations, from nothing and from a rival, at which an effect is named with this probability.

    The log Bayes factor of two simple hypotheses at a squared separation q is Gaussian with mean q/2 and variance q; it
    must exceed the threshold, with its prior odds, with the probability `power`. margin: factor on both.

    >>> [round(q, 1) for q in wanted_separations(0.9)]
    [29.9, 16.2]
    """
    z = float(ndtri(power))
    odds = NAMED / (1 - NAMED)
    thresholds = (np.log(odds / PRIOR_ODDS) + OCCAM, np.log(odds))
    against_nothing, against_rival = ((z + np.sqrt(z**2 + 2 * t)) ** 2 for t in thresholds)
    return margin * float(against_nothing), margin * float(against_rival)


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
        schedule = make_schedule(self.library, chosen, self.rig)
        return schedule, separations(total_information(self.pieces, schedule), self.true, self.rivals)


def potential(candidates: Candidates, allowed: Sequence[int]) -> list[Array]:
    """Separations along all allowed pieces with all their copies: what no protocol of them exceeds by much."""
    return candidates.found(list(allowed) * MAX_COPIES)[1]


def make_targets(found: Sequence[Array], wanted: tuple[float, float]) -> Targets:
    """The targets that the separations `found` of all pieces together reach."""
    scales = Targets(wanted, ())
    return Targets(wanted, tuple(part >= scales.scale(part.shape[1]) for part in found))


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
        best = _best_addition(candidates, allowed, targets, seconds, chosen, share)
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


def _best_addition(
    candidates: Candidates,
    allowed: Sequence[int],
    targets: Targets,
    seconds: float,
    chosen: list[int],
    share: float,
) -> tuple[float, int] | None:
    """The criterion with the piece of the largest gain per second, and that piece; None where none is worth it."""
    now = make_schedule(candidates.library, chosen, candidates.rig).seconds if chosen else 0.0
    best, rate = None, 0.0
    for index in allowed:
        if chosen.count(index) >= MAX_COPIES:
            continue
        if make_schedule(candidates.library, [*chosen, index], candidates.rig).seconds > seconds:
            continue
        schedule, found = candidates.found([*chosen, index])
        reached = targets.share(found)
        gain = reached - share
        per_second = gain / max(schedule.seconds - now, 1.0)
        if gain > MIN_GAIN and per_second > rate:
            best, rate = (reached, index), per_second
    return best


def _without_dispensable(candidates: Candidates, targets: Targets, chosen: list[int], share: float) -> list[int]:
    """The pieces without those, longest first, whose removal costs less than `MIN_GAIN` of the criterion."""
    kept = list(chosen)
    for index in sorted(chosen, key=lambda k: -candidates.library[k].seconds):
        rest = list(kept)
        rest.remove(index)
        if rest and targets.share(candidates.found(rest)[1]) >= min(share, 1.0) - MIN_GAIN:
            kept = rest
    return kept
