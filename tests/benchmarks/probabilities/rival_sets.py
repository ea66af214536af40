"""The set of effects that is hardest to exclude where others are true, and how often a judge who has to exclude that
one alone names the true set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logit
from scipy.stats import norm

from reefmu.diagnosis.calibrated_odds import NAMED, log_odds
from reefmu.diagnosis.estimation.least_squares import HELD_SIZE, Fit, FitOptions
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit, promising_starts, restrict_fit
from reefmu.diagnosis.estimation.shared_covariances import cost_of_clearance
from reefmu.diagnosis.forward.predictor import Predictor
from reefmu.diagnosis.probabilities.assessment import stated_sizes
from reefmu.diagnosis.probabilities.marginal_likelihood import log_volume
from reefmu.effects import find_effect
from tests.benchmarks.probabilities.likelihood_ratio import log_ratio


def bound(separation: float, advantage: float, least: float = NAMED) -> float:
    """Greatest probability with which a rule that names from a probability of `least` names the truth."""
    return float(norm.cdf(_margin(separation, advantage, least)))


def _margin(separation: float, advantage: float, least: float) -> float:
    """By how many of its standard deviations the mean of the log odds exceeds those of a probability `least`."""
    return float((separation**2 / 2 + advantage - logit(least)) / max(separation, 1e-9))


def true_fit(problem: Problem, names: tuple[str, ...], known: Mapping[str, Mapping[str, float]]) -> Fit:
    """The true set with the scatter at its contacts: parameters `known` by effect as they are, others as they are
    fitted best."""
    found = base_fit(problem)
    for name in names:
        true = known.get(name, {})
        first = np.array([true.get(p.name, p.nominal) for p in find_effect(name).parameters])
        starts = [np.concatenate([found.parameters, first])]
        starts += [start.parameters for start in promising_starts(problem, found, [name])]
        found = min((problem.fit_from((*found.names, name), s) for s in starts), key=lambda fit: fit.cost)
    weights = problem.weights_at(found) or problem.weights_of_contacts(found)
    parameters = problem.fit_from(names, found.parameters, weights).parameters.copy()
    for name, where in problem.layout(names).effects.items():
        true = known.get(name, {})
        for at, parameter in zip(range(where.start, where.stop), find_effect(name).parameters, strict=True):
            parameters[at] = true.get(parameter.name, parameters[at])
    return problem.fit_from(names, parameters, weights, FitOptions(steps=0))


@dataclass(frozen=True)
class Rival:
    """The other set that is hardest to exclude; fields as of `Outcome`."""

    separation: float
    advantage: float
    lost: str
    rival: str


def nearest(problem: Problem, true: Fit) -> Rival:
    """The rival of a fit's set, judged by the scatter at the contacts of that fit, which costs an individual at another
    clearance what it costs by its tolerances, or of the set without an effect by its own scatter."""
    torque = Predictor(problem.trace, problem.base, true.names)(true.parameters).torque
    expected = replace(problem, trace=replace(problem.trace, torque=torque), weights=true.weighting, weights_cache=[])
    sizes = stated_sizes(problem)

    def advantage(found: Fit) -> float:
        prior = [log_volume(problem, f, sizes, 1.0) + float(log_odds(0.0, len(f.names))) for f in (true, found)]
        return prior[0] - prior[1]

    rivals: list[Rival] = []
    for lost in true.names:
        names, parameters = restrict_fit(problem, true, frozenset(true.names) - {lost})
        without = expected.fit_from(names, parameters, true.weighting, HELD_SIZE)
        others = [name for name in problem.candidates if name not in true.names]
        starts = promising_starts(expected, without, others)
        fits = [without, *(expected.fit_from(s.names, s.parameters, true.weighting, HELD_SIZE) for s in starts)]
        for found in fits:
            taken = "".join(set(found.names) - set(true.names))
            of_clearance = cost_of_clearance(problem, found, true) / 2 if true.weighting.is_individual else 0.0
            rivals.append(Rival(float(np.sqrt(found.chi_square)), advantage(found) + of_clearance, lost, taken))
        if true.weighting.is_individual:
            own = problem.weights_at(without) or problem.weights_of_contacts(without)
            found = expected.fit_from(names, parameters, own.with_size(true.weighting.size), HELD_SIZE)
            mean, deviation = log_ratio(true.weighting, found.weighting, expected.torque - found.prediction.torque)
            rivals.append(Rival(deviation, advantage(found) + mean - deviation**2 / 2, lost, ""))
    # Of rivals that are all excluded for certain the margin still tells the nearest.
    return min(rivals, key=lambda r: _margin(r.separation, r.advantage, NAMED))
