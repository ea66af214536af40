"""What a name does against what a single drive of these tolerances does by itself."""

from __future__ import annotations

from ...effects import EFFECTS, ToleranceSignature, find_effect
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.search import restrict_fit
from ..estimation.weighting import INDIVIDUAL_SIZE, SCATTER_SIZES
from .model_comparison import FORM_ERROR, crank_stands
from .population_spread import as_individual_drive

CURVE_EFFECTS = frozenset(
    e.name for e in EFFECTS.values() if e.identification.tolerance_signature is ToleranceSignature.CURVE
)
"""Effects that a curve over the twist shows, the sensor's among them."""
SCATTER_LIKE = frozenset(e.name for e in EFFECTS.values() if e.identification.tolerance_signature)
"""Effects that do what deviations of the parts do: curves, and ripple over a turn."""
MAX_INDIVIDUAL_GAIN = 150.0
"""Gain of a set on the mean drive over a smaller one on an individual that no individual reaches."""
CHANCE_GAIN, CHANCE_GAIN_PER_PARAMETER = 16.0, 8.0
"""Gain of a name over a single drive at one angle of the crank that chance does not give: a single drive is the less
likely the more sizes of its curve must vanish, but every parameter takes one of them away."""
IMPLAUSIBLE_SIZE = 2.0
"""Size of the scatter that these tolerances hardly make."""
LARGEST_PLAUSIBLE_SIZE = max(size for size in SCATTER_SIZES if size < IMPLAUSIBLE_SIZE)


def limited_to_tolerances(problem: Problem, smaller: Fit, fit: Fit) -> Fit:
    """The fit without a name, as of a drive of these tolerances where the name makes it one: a scatter wider than they
    make explains all there is."""
    if smaller.weighting.size < IMPLAUSIBLE_SIZE or fit.weighting.size >= IMPLAUSIBLE_SIZE:
        return smaller
    return problem.fit_from(
        smaller.names, smaller.parameters, smaller.weighting.with_size(LARGEST_PLAUSIBLE_SIZE), options=HELD_SIZE
    )


def may_be_individual(problem: Problem, fit: Fit, base: Fit, smaller: Fit, name: str, overdispersion: float) -> bool:
    """Whether this drive may be an individual: it scatters, or the record cannot tell and an individual, or several
    names for what it does by itself, would do hardly worse. smaller: the fit without the name."""
    if fit.weighting.size >= INDIVIDUAL_SIZE:
        wide = smaller.weighting.size >= IMPLAUSIBLE_SIZE > fit.weighting.size
        return (name in SCATTER_LIKE and not wide) or (
            smaller.cost - fit.cost
        ) / overdispersion < 4 * MAX_INDIVIDUAL_GAIN
    if crank_stands(problem):
        return name in SCATTER_LIKE and _by_chance(problem, fit, base, smaller, name, overdispersion)
    if (
        problem.is_mean_drive
        or name not in CURVE_EFFECTS
        or (len(fit.names) == 1 and base.weighting.size < INDIVIDUAL_SIZE)
    ):
        return False
    # What scatters less than any single drive does is none.
    single = smaller if smaller.weighting.size >= INDIVIDUAL_SIZE else as_individual_drive(problem, smaller)
    return (single.cost - fit.cost) / overdispersion < MAX_INDIVIDUAL_GAIN


def _by_chance(problem: Problem, fit: Fit, base: Fit, smaller: Fit, name: str, overdispersion: float) -> bool:
    """Whether names that do what parts do are hardly likelier than a single drive, whose curve at one angle of the
    crank has but a few sizes, or than another form of the effects beside them: each of them, and all together."""
    alike = SCATTER_LIKE & set(fit.names)
    others = frozenset(fit.names) - alike
    plain = problem.fit_from(*restrict_fit(problem, fit, others)) if others else base
    for without, names in ((smaller, {name}), (plain, alike)):
        least = sum(CHANCE_GAIN + CHANCE_GAIN_PER_PARAMETER * len(find_effect(n).parameters) for n in names)
        if without.weighting.size >= INDIVIDUAL_SIZE and without.cost - fit.cost < overdispersion * least:
            return True
    return plain.cost - fit.cost < FORM_ERROR * (base.cost - plain.cost)
