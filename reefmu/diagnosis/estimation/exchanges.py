"""Effects that a record cannot tell from a named one, found from the record's own information.

The change of the torque that an effect makes, whitened and orthogonal to all that is fitted beside it, holds the
information by which the record shows it. An effect whose sensitivities make a small angle with this change may take its
place. The set with the place taken is then fitted, also to the torque that the chosen set predicts: what it misses of
that is twice the Kullback-Leibler divergence of both sets on this record, the gain in -2 log likelihood by which the
record is expected to decide between them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import Effect, find_effect
from .least_squares import HELD_SIZE, Fit, fit
from .problem import Problem
from .residuals import torque_without
from .score_test import amplitudes, linearise, orthonormal_basis, score_gains, starting_parameters
from .search import is_degenerate, restrict_fit

MIN_EXPLAINED = 0.8
"""Share of an effect's information (squared cosine of the angle) that another effect must explain to first order to be
fitted in its place. Chosen by judgement to save time: a pair that a record hardly tells apart explains nearly all."""
EXPECTED_GAIN = 9.0
"""Expected gain in -2 log likelihood up to which a record does not decide between two sets. It has twice its root as
standard deviation, so that at 9 one record in fifteen would favour the wrong set."""
LAW_SHARE = 0.004
"""The same as a share of the effect's information, because the true law of an effect differs from the model's; that of
`alternatives.EQUIVALENT_SHARE`."""


@dataclass(frozen=True)
class Exchange:
    """A set with one effect exchanged for another.

    fit: to the record; information: by which the record shows the effect that was exchanged; expected_gain: by which it
    decides between both sets. Both are in -2 log likelihood.
    """

    fit: Fit
    information: float
    expected_gain: float

    @property
    def is_indistinguishable(self) -> bool:
        """Whether the record is not expected to decide between the set and the chosen one."""
        return self.expected_gain < max(EXPECTED_GAIN, LAW_SHARE * self.information)


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
            yield Exchange(found, start.information, max(missed, 0.0))


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
    beside = np.delete(chosen.prediction.sensitivities, np.arange(own.start, own.stop), axis=1)
    basis = orthonormal_basis(weights, beside)
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
    return fit(problem.predictor(found.names), torque, truth.weighting, found.bounds, found.parameters, HELD_SIZE)
