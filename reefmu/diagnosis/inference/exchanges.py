"""Sets with one effect exchanged for another that a record shows in nearly the same way.

The change of the torque that an effect makes, whitened and orthogonal to all that is fitted beside it, holds the
information by which the record shows it. An effect whose sensitivities make a small angle with this change may take its
place, whether or not the search fitted the set in which it does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import Effect, find_effect
from ..estimation.intervals import is_degenerate
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import torque_without
from ..estimation.score_test import absorbing_basis, amplitudes, linearise, score_gains, starting_parameters
from ..estimation.search import restrict_fit

MIN_EXPLAINED = 0.8
"""Share of an effect's information (squared cosine of the angle) that another effect must explain to first order to be
fitted in its place. Chosen by judgement to save time: a pair that a record hardly tells apart explains nearly all."""


def exchanged_fits(problem: Problem, chosen: Fit) -> Iterator[Fit]:
    """Fits of the sets in which an effect of the chosen set is exchanged for another of no more parameters."""
    for name in chosen.names:
        for start in _starts(problem, chosen, name):
            found = problem.fit_from(start.names, start.parameters)
            if is_degenerate(problem, chosen) or not is_degenerate(problem, found):
                yield found


@dataclass(frozen=True)
class _Start:
    """names: of a set; parameters: (k,), where its fit begins."""

    names: tuple[str, ...]
    parameters: Array


def _starts(problem: Problem, chosen: Fit, name: str) -> Iterator[_Start]:
    """Starts of the sets in which another effect takes the place of `name`."""
    weights = chosen.weighting
    names, parameters = restrict_fit(problem, chosen, frozenset(chosen.names) - {name})
    others = replace(chosen, names=names, parameters=parameters)
    own = problem.layout(chosen.names).effects[name]
    is_own = np.arange(own.start, own.stop)
    beside = np.delete(chosen.prediction.sensitivities, is_own, axis=1)
    basis = absorbing_basis(weights, beside, np.delete(chosen.bounds.prior_deviation, is_own))
    change = weights.whiten(chosen.prediction.torque - torque_without(problem, chosen, [name]))
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
        directions = linearise(problem, candidate, others, [alike])
        gains = score_gains(directions, weights, basis, change)
        for direction, (gain, sizes) in zip(directions, gains, strict=True):
            if gain > best:
                best, start = gain, starting_parameters(direction, sizes)
        if start is not None:
            yield _Start((*names, candidate), np.concatenate([parameters, start]))


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
