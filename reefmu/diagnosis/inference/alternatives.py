"""Other sets of effects: those that explain the record as well, and those that the scatter of tolerances may mask.

The change of the torque that an effect makes, whitened and orthogonal to all that is fitted beside it, holds the
information by which the record shows it. An effect whose sensitivities make a small angle with this change may take its
place. The set with the place taken is then fitted, also to the torque that the chosen set predicts: what it misses of
that is twice the Kullback-Leibler divergence of both sets on this record, the gain in -2 log likelihood by which the
record is expected to decide between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import Effect, find_effect
from ..estimation.least_squares import HELD_SIZE, Fit, by_cost
from ..estimation.least_squares import fit as fit_set
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion, torque_without
from ..estimation.score_test import absorbing_basis, amplitudes, linearise, score_gains, starting_parameters
from ..estimation.search import is_degenerate, restrict_fit
from ..estimation.weighting import INDIVIDUAL_SIZE, MEAN_DRIVE_SIZE
from .evidence import Evidence
from .individual_drive import IMPLAUSIBLE_SIZE, SCATTER_EFFECTS

EQUIVALENT_SHARE, EQUIVALENT_COST = 0.004, 9.0
"""Cost by which another set may be worse and still be an alternative: this share of the gain in which the two differ,
and at least three standard deviations of a normal variable, squared. The share is chosen by judgement; without it at
most one of 136 verdicts changes (ablation)."""
GENERAL_COST = 2.0
"""The same for a set with more parameters that can imitate the chosen one, because it holds it as a limit or gains no
more than it does by chance; chosen by judgement."""
MAX_EQUIVALENT, MAX_MASKED = 5, 3
"""Sets that are reported at most, the best of them, for a reader's sake."""
MIN_EXPLAINED = 0.8
"""Share of an effect's information (squared cosine of the angle) that another effect must explain to first order to be
fitted in its place. Chosen by judgement to save time: a pair that a record hardly tells apart explains nearly all."""
EXPECTED_GAIN = 9.0
"""Expected gain in -2 log likelihood up to which a record does not decide between two sets. It has twice its root as
standard deviation, so that at 9 one record in fifteen would favour the wrong set."""


def equivalent_sets(evidence: Evidence, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets of no more effects that explain the record as well as the chosen one, the best first.

    The search fits only some sets of each size; those that the record cannot tell from the chosen one by its
    information are added, whether the search fitted them or not.
    """
    fitted, exchanged = _fitted_sets(evidence, chosen), indistinguishable_sets(evidence.problem, chosen)
    return tuple(dict.fromkeys((*fitted, *exchanged)))[:MAX_EQUIVALENT]


def indistinguishable_sets(problem: Problem, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets with one effect of the chosen set exchanged that the record cannot tell from it, and, where several effects
    can be exchanged, with all of them exchanged, the best first."""
    found = sorted((e for e in exchanges(problem, chosen) if e.is_indistinguishable), key=lambda e: by_cost(e.fit))
    sets = [tuple(sorted(e.fit.names)) for e in found]
    pairs = [(set(chosen.names) - set(names), set(names) - set(chosen.names)) for names in sets]
    for first, (lost, gained) in enumerate(pairs):
        for other_lost, other_gained in pairs[first + 1 :]:
            if not lost & other_lost and not gained & other_gained:
                both = (set(chosen.names) - lost - other_lost) | gained | other_gained
                sets.append(tuple(sorted(both)))
    return tuple(sets)


def _fitted_sets(evidence: Evidence, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets that the search fitted and that explain the record as well as the chosen one, the best first."""
    problem, thresholds = evidence.problem, evidence.thresholds
    best = evidence.search.best
    fits: Sequence[Fit] = [fit for size, fits in best.items() if 0 < size <= len(chosen.names) for fit in fits]
    found: list[tuple[str, ...]] = []
    for fit in sorted(fits, key=by_cost):
        if set(fit.names) == set(chosen.names):
            continue
        # A gain that a drive without effects reaches by chance does not count.
        chance = max(0.0, thresholds.total(fit) - thresholds.total(chosen))
        more = fit.n_effect_parameters - chosen.n_effect_parameters
        common = frozenset(fit.names) & frozenset(chosen.names)
        without = evidence.fits[common].cost if common in evidence.fits else evidence.search.base.cost
        allowance = max(EQUIVALENT_COST, EQUIVALENT_SHARE * (without - chosen.cost))
        is_significant = evidence.search.base.cost - fit.cost > thresholds.total(fit)
        if more > 0 and (_generalises(fit, chosen) or not is_significant):
            allowance = GENERAL_COST
        elif more > 0:
            # Another law, found as surely: its further parameters cost what they gain by chance (Akaike's criterion).
            chance = 2.0 * more
        worse = fit.cost - chosen.cost + chance
        if worse < allowance and not is_degenerate(problem, fit) and not _is_resolved_limit(evidence, fit, chosen):
            found.append(tuple(sorted(fit.names)))
    return tuple(found)


def _generalises(other: Fit, chosen: Fit) -> bool:
    """Whether a set holds the chosen one as a limit, so that it can always imitate it."""
    lost, gained = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    return all(find_effect(name).identification.limit_of in gained for name in lost)


def _is_resolved_limit(evidence: Evidence, other: Fit, chosen: Fit) -> bool:
    """Whether a set differs only by a general effect of which the chosen effect is the limit, and the record can tell
    the two apart."""
    mine, theirs = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    if len(mine) != 1 or len(theirs) != 1:
        return False
    (limit,), (general,) = mine, theirs
    pairs = map(set, evidence.indistinguishable)
    return find_effect(limit).identification.limit_of == general and {limit, general} not in pairs


def masked_sets(evidence: Evidence, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets with one more effect, which the scatter of the tolerances may mask, the best first.

    They gain more than noise does, but not enough to be significant on an individual. A set that makes the scatter
    plausible, or makes the drive the mean drive, need not gain anything.
    """
    problem = evidence.problem
    if problem.is_mean_drive:
        return ()
    dispersion, size = estimate_overdispersion(problem, chosen), chosen.weighting.size
    found: list[tuple[str, ...]] = []
    for fit in sorted(evidence.search.best.get(len(chosen.names) + 1, []), key=by_cost):
        more = set(fit.names) - set(chosen.names)
        if len(more) != 1 or (name := more.pop()) not in SCATTER_EFFECTS or is_degenerate(problem, fit):
            continue
        becomes_mean_drive = size >= INDIVIDUAL_SIZE and fit.weighting.size <= MEAN_DRIVE_SIZE
        becomes_narrower = size >= IMPLAUSIBLE_SIZE and fit.weighting.size < size
        noise_gain = dispersion * evidence.thresholds.noise[name]
        if chosen.cost - fit.cost > (0.0 if becomes_mean_drive or becomes_narrower else noise_gain):
            found.append(tuple(sorted(fit.names)))
    return tuple(found[:MAX_MASKED])


@dataclass(frozen=True)
class Exchange:
    """A set with one effect exchanged for another.

    fit: to the record; information: by which the record shows the effect that was exchanged; expected_gain: by which it
    decides between both sets. Both are in -2 log likelihood.
    """

    fit: Fit
    information: float
    expected_gain: float
    observed_gain: float

    @property
    def is_indistinguishable(self) -> bool:
        """Whether the record neither decides between the set and the chosen one nor is expected to."""
        return max(self.expected_gain, self.observed_gain) < EXPECTED_GAIN


def exchanges(problem: Problem, chosen: Fit) -> Iterator[Exchange]:
    """The sets with one effect exchanged for another of no more parameters that the record shows in nearly the same
    way."""
    truth = _fit_to_prediction(problem, chosen, chosen).chi_square
    for name in chosen.names:
        for start in _starts(problem, chosen, name):
            found = problem.fit_from(start.names, start.parameters)
            if is_degenerate(problem, found) and not is_degenerate(problem, chosen):
                continue
            missed = _fit_to_prediction(problem, found, chosen).chi_square - truth
            yield Exchange(found, start.information, max(missed, 0.0), found.cost - chosen.cost)


@dataclass(frozen=True)
class _Start:
    """names: of a set; parameters: (k,), where its fit begins; information: by which the record shows the effect that
    was exchanged."""

    names: tuple[str, ...]
    parameters: Array
    information: float


def _starts(problem: Problem, chosen: Fit, name: str) -> Iterator[_Start]:
    """Starts of the sets in which another effect takes the place of `name`."""
    weights = chosen.weighting
    names, parameters = restrict_fit(problem, chosen, frozenset(chosen.names) - {name})
    others = replace(chosen, names=names, parameters=parameters)
    own = problem.layout(chosen.names).effects[name]
    is_own = np.arange(own.start, own.stop)
    beside = np.delete(chosen.prediction.sensitivities, is_own, axis=1)
    basis = absorbing_basis(weights, beside, np.delete(chosen.bounds.prior_deviation, is_own))
    change = weights.whiten(chosen.prediction.torque - torque_without(problem, chosen, name))[:, None]
    change = change - basis @ (basis.T @ change)
    information = float((change**2).sum())
    for candidate in problem.candidates:
        effect = find_effect(candidate)
        if candidate in chosen.names or effect.identification.sign_pair in names:
            continue
        if len(effect.parameters) > len(find_effect(name).parameters):
            continue
        best, start = MIN_EXPLAINED * information, None
        alike = _with_values_of(effect, find_effect(name), chosen.parameters[own])
        for direction in linearise(problem, candidate, others, [alike]):
            gain, sizes, _ = score_gains(direction, weights, basis, change)
            if gain[0] > best:
                best, start = float(gain[0]), starting_parameters(direction, sizes[:, 0])
        if start is not None:
            yield _Start((*names, candidate), np.concatenate([parameters, start]), information)


def _with_values_of(effect: Effect, other: Effect, values: Array) -> Array:
    """(q,) neutral parameters of an effect, but those that are no amplitudes and have the name and the unit of one of
    the other effect with its value; values: (r,) of the other effect.

    Beside effects that act nearly alike, only a length or a time that is as accurate shows how alike they are.
    """
    known = {(p.name, p.unit): value for p, value in zip(other.parameters, values.tolist(), strict=True)}
    sizes = set(amplitudes(effect))
    return np.array(
        [p.neutral if k in sizes else known.get((p.name, p.unit), p.neutral) for k, p in enumerate(effect.parameters)]
    )


def _fit_to_prediction(problem: Problem, found: Fit, truth: Fit) -> Fit:
    """A set fitted to the torque that another set predicts, under the weights of that other set."""
    torque = truth.prediction.torque
    return fit_set(problem.predictor(found.names), torque, truth.weighting, found.bounds, found.parameters, HELD_SIZE)
