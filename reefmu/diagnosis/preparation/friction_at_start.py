"""Friction that is built up when a run starts.

No record says what came before a run: friction may be built up in either direction when it starts, or be released.
Where the record shows this, every run has its own share of the friction at its start, of which any from -1 to 1 is as
likely. The torque is linear in the shares, so that their estimates beside the parameters of a fit, and the likelihood
averaged over them, are those of random effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import IndependentVariable
from ..estimation.least_squares import HELD_SIZE, Fit, by_cost
from ..estimation.problem import Problem
from ..estimation.search import MIN_GAIN

DEVIATION = 1 / np.sqrt(3)
"""Standard deviation of a share of which any from -1 to 1 is as likely."""
N_TRIED, N_ROUNDS = 4, 8
"""Fits of one kind of friction beside which the shares are estimated, and the rounds in which shares and parameters are
estimated in turn. Chosen by judgement: from where shares are the greatest that there are, and the parameters as wrong
as that makes them, further rounds change the cost of the true set by less than 4."""


def with_friction_at_start(problem: Problem, fits: Sequence[Fit]) -> Problem:
    """The problem with the shares of the friction that are built up when its runs start, along every angle for which
    one of its fits has a lower cost with them than any has without; itself where none has.

    Where the record hardly tells two angles apart, as at a locked crank, friction along either has shares of its own.
    """
    least = min(fit.cost for fit in fits) - MIN_GAIN
    by_paths: dict[frozenset[IndependentVariable], list[Fit]] = {}
    for fit in sorted(fits, key=by_cost):
        by_paths.setdefault(fit.friction_paths, []).append(fit)
    found = [
        started for alike in by_paths.values() for fit in alike[:N_TRIED] for started in _likelier(problem, fit, least)
    ]
    for started, fit in sorted(found, key=_cost_of_paths):
        if not fit.friction_paths & problem.trace.friction.keys():
            friction = {**problem.trace.friction, **started.trace.friction}
            cost = {**problem.cost_of_start, **started.cost_of_start}
            problem = replace(problem, trace=replace(problem.trace, friction=friction), cost_of_start=cost)
    return problem


def _cost_of_paths(found: tuple[Problem, Fit]) -> float:
    """The cost of a fit and of its friction at the start of runs, of which that along a further angle must gain as
    well."""
    problem, fit = found
    return fit.cost + problem.start_cost(fit) + MIN_GAIN * len(fit.friction_paths)


def _likelier(problem: Problem, fit: Fit, least: float) -> list[tuple[Problem, Fit]]:
    """The problem with friction at the start of runs and the fit to it; none unless its cost with that of the shares is
    below `least`."""
    if not fit.friction_paths:
        return []
    for _ in range(N_ROUNDS):
        gain, problem = _with_shares(problem, fit)
        if fit.cost + problem.start_cost(fit) - gain >= least:
            return []
        fit = problem.fit_from(fit.names, fit.parameters, fit.weighting, HELD_SIZE)
    return [(problem, fit)]


def _with_shares(problem: Problem, fit: Fit) -> tuple[float, Problem]:
    """What a fit gains by the likeliest shares of its friction, in -2 log likelihood, and the problem with them and
    with their cost, that of the likelihood averaged over all shares."""
    trace, weights = problem.trace, fit.weighting
    paths = [path for path in IndependentVariable if path in fit.friction_paths]
    runs = len(trace.run_ranges)
    built_up = np.concatenate([_built_up(problem, fit, path) for path in paths], axis=1)
    before = np.concatenate([trace.friction.get(path, np.zeros(runs)) for path in paths])
    residual = problem.torque - fit.prediction.torque
    left = residual + built_up @ before
    scaled = weights.project(DEVIATION * built_up)
    precision = scaled.inner(scaled) + np.eye(len(before))
    shares = DEVIATION * np.linalg.solve(precision, scaled.inner(weights.project(left)))
    # Beyond its bounds a share is at them, and costs what it leaves there.
    shares = np.clip(shares, -1.0, 1.0)
    gain = weights.cost(residual) - weights.cost(left - built_up @ shares)
    volume = 2 * np.log(np.diag(np.linalg.cholesky(precision)))
    costs = ((shares / DEVIATION) ** 2 + volume).reshape(len(paths), runs).sum(axis=1)
    started = replace(trace, friction=dict(zip(paths, shares.reshape(len(paths), runs), strict=True)))
    return gain, replace(problem, trace=started, cost_of_start=dict(zip(paths, costs.tolist(), strict=True)))


def _built_up(problem: Problem, fit: Fit, path: IndependentVariable) -> Array:
    """(n, runs) N.m, what friction along a path adds to the torque of a fit where it is built up when a run starts."""
    runs = len(problem.trace.run_ranges)
    run = np.cumsum(problem.trace.start)[problem.blocks.first] - 1

    def torque(share: float) -> Array:
        friction = {**problem.trace.friction, path: np.full(runs, share)}
        started = replace(problem, trace=replace(problem.trace, friction=friction))
        return started.predictor(fit.names)(fit.parameters).torque

    return (torque(1.0) - torque(0.0))[:, None] * (run[:, None] == np.arange(runs))
