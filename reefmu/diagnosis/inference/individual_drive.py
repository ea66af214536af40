"""What an individual drive of the population shows without any effect, compared with an effect or a residual."""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, ToleranceSignature, find_effect
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.search import restrict_fit
from ..estimation.weighting import INDIVIDUAL_SIZE, SCATTER_SIZES

CURVE_EFFECTS = frozenset(
    e.name for e in EFFECTS.values() if e.identification.tolerance_signature is ToleranceSignature.CURVE
)
"""Effects that change the curve of torque over twist as deviations of the parts do."""
SCATTER_EFFECTS = frozenset(e.name for e in EFFECTS.values() if e.identification.tolerance_signature)
"""Effects that act as deviations of the parts do: on the curve, or as a ripple over a turn of the crank."""
MAX_INDIVIDUAL_GAIN = 150.0
"""Gain of an effect on the mean drive, over the same set without it on an individual, that tolerances do not reach.
Chosen on simulated records; without the rule 3 of 136 verdicts become worse (ablation)."""
INDIVIDUAL_GAIN_FACTOR = 4.0
"""Factor on `MAX_INDIVIDUAL_GAIN` where the fit itself is that of an individual; chosen by judgement."""
CHANCE_GAIN, CHANCE_GAIN_PER_PARAMETER = 16.0, 8.0
"""Gain that an effect must reach over an individual at one angle of the crank, and more for each parameter, since each
parameter removes one degree of freedom of the individual's curve. Chosen by judgement; without the rule a small
clearance is not named in one loop of a mean drive."""
LAW_ERROR = 0.01
"""Share of the gain of named effects within which a gain beside them is put down to an error of their law, so that it
justifies neither a further effect of their group nor a nonparametric term in their place. Chosen on simulated records
with other constitutive laws; without it 2 of 136 verdicts change (ablation)."""
IMPLAUSIBLE_SIZE = 2.0
"""Scatter size that the stated tolerances hardly make; chosen by judgement, without the rule no verdict changes
(ablation)."""
LARGEST_PLAUSIBLE_SIZE = max(size for size in SCATTER_SIZES if size < IMPLAUSIBLE_SIZE)
"""Largest of the scatter sizes tried that the stated tolerances make."""
MAX_POPULATION_DEVIATIONS = 3.0
"""Standard deviations from the mean drive up to which individuals are expected: the usual three-sigma limit, because
some dozens of simulated individuals do not show the extremes of the population."""
RANGE_MARGIN = 1.1
"""Factor by which the range of the simulated individuals is widened at both ends; chosen by judgement."""


def crank_stands(problem: Problem) -> bool:
    """Whether the crank stands, so that the curve of an individual is as smooth as that of the mean drive."""
    return problem.scatter is not None and problem.scatter.crank_stands


def as_individual(problem: Problem, fit: Fit) -> Fit:
    """The same set fitted under the hypothesis that the drive scatters, at least as much as any individual does."""
    rest = problem.torque - fit.prediction.torque
    likeliest = problem.weights.with_likeliest_scatter(rest, INDIVIDUAL_SIZE)
    return problem.fit_from(fit.names, fit.parameters, likeliest, options=HELD_SIZE)


def limited_to_tolerances(problem: Problem, smaller: Fit, fit: Fit) -> Fit:
    """The fit without an effect, refitted with a plausible scatter where the effect makes the scatter plausible.

    An implausibly wide scatter explains anything, so it must not compete with the effect.
    """
    if smaller.weighting.size < IMPLAUSIBLE_SIZE or fit.weighting.size >= IMPLAUSIBLE_SIZE:
        return smaller
    weights = smaller.weighting.with_size(LARGEST_PLAUSIBLE_SIZE)
    return problem.fit_from(smaller.names, smaller.parameters, weights, options=HELD_SIZE)


def may_be_individual(problem: Problem, fit: Fit, base: Fit, smaller: Fit, name: str, dispersion: float) -> bool:
    """Whether an individual drive may make what a fit names, so that the effect must stand out of the population.

    It may if the drive scatters, or if the record does not tell and an individual explains it hardly worse. base: the
    fit without effects; smaller: the fit without the effect `name`; dispersion: of the noise
    (`estimate_overdispersion`).
    """
    gain = smaller.cost - fit.cost
    if fit.weighting.size >= INDIVIDUAL_SIZE:
        becomes_plausible = smaller.weighting.size >= IMPLAUSIBLE_SIZE > fit.weighting.size
        acts_like_scatter = name in SCATTER_EFFECTS and not becomes_plausible
        return acts_like_scatter or gain / dispersion < INDIVIDUAL_GAIN_FACTOR * MAX_INDIVIDUAL_GAIN
    if crank_stands(problem):
        return name in SCATTER_EFFECTS and _may_be_chance(problem, fit, base, smaller, name, dispersion)
    only_effect_of_mean_drive = len(fit.names) == 1 and base.weighting.size < INDIVIDUAL_SIZE
    if problem.is_mean_drive or name not in CURVE_EFFECTS or only_effect_of_mean_drive:
        return False
    # A scatter below that of any individual is none.
    individual = smaller if smaller.weighting.size >= INDIVIDUAL_SIZE else as_individual(problem, smaller)
    return (individual.cost - fit.cost) / dispersion < MAX_INDIVIDUAL_GAIN


def _may_be_chance(problem: Problem, fit: Fit, base: Fit, smaller: Fit, name: str, dispersion: float) -> bool:
    """Whether the effects that act like scatter, each alone or all together, are hardly likelier than an individual or
    than another law of the effects beside them.

    At one angle of the crank the curve of an individual has only a few degrees of freedom.
    """
    scatter_effects = SCATTER_EFFECTS & set(fit.names)
    others = frozenset(fit.names) - scatter_effects
    plain = problem.fit_from(*restrict_fit(problem, fit, others)) if others else base
    for without, names in ((smaller, {name}), (plain, scatter_effects)):
        least = sum(CHANCE_GAIN + CHANCE_GAIN_PER_PARAMETER * len(find_effect(n).parameters) for n in names)
        if without.weighting.size >= INDIVIDUAL_SIZE and without.cost - fit.cost < dispersion * least:
            return True
    return plain.cost - fit.cost < LAW_ERROR * (base.cost - plain.cost)


def population_deviations(problem: Problem, fit: Fit, change: Array) -> float:
    """Size of a torque change (n,), N.m, in standard deviations of the population in the direction of that change.

    Where an effect is only a few deviations large, a misfit of some per cent in the scatter would decide about it. The
    twist's zero, which is free, does not count. Infinite where no drawing states tolerances.
    """
    if not len(problem.individuals):
        return float("inf")
    scale = 1 / np.sqrt(problem.variance)
    zero = fit.prediction.sensitivities[:, 0] * scale
    zero = zero / max(float(np.linalg.norm(zero)), 1e-300)
    along = change * scale
    along = along - zero * float(zero @ along)
    size = float(along @ along)
    # Individuals deviate from the mean drive's curve also where the elements' passing is the same for all of them.
    deviation = float(np.sqrt(np.mean((problem.individuals @ (along * scale)) ** 2)))
    return size / max(deviation, 1e-300)


def residual_outside_population(problem: Problem, fit: Fit) -> float:
    """Rms, N.m, of a fit's residual without the noise, if it is above or below the range of the individuals of the
    population; 0 if it is within that range or no drawing states tolerances."""
    rest = float(np.mean((problem.torque - fit.prediction.torque) ** 2) - np.mean(problem.block_variance))
    rest = float(np.sqrt(max(rest, 0.0)))
    if not len(problem.individuals):
        return 0.0
    zero = fit.prediction.sensitivities[:, 0]
    zero = zero / max(float(np.linalg.norm(zero)), 1e-300)
    drives = problem.individuals - np.outer(problem.individuals @ zero, zero)
    each = np.sqrt(np.mean(drives**2, axis=1))
    most = max(float(each.max()), MAX_POPULATION_DEVIATIONS * float(np.sqrt(np.mean(each**2))))
    return 0.0 if each.min() / RANGE_MARGIN <= rest <= most * RANGE_MARGIN else rest
