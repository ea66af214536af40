"""What a name does against what a single drive of these tolerances does by itself."""

from __future__ import annotations

from ...effects import EFFECTS, Likeness
from ..estimation.least_squares import Fit
from ..estimation.problem import Study
from ..estimation.search import part_of
from ..estimation.weighting import INDIVIDUAL, SIZES
from ..forward.effect_functions import kernel
from .model_comparison import FORM_ERROR, stands
from .population import as_individual

SHOWN_BY_A_CURVE = frozenset(e.name for e in EFFECTS.values() if e.identification.likeness is Likeness.CURVE)
"""Effects that a curve over the twist shows, the sensor's among them."""
LIKE_SCATTER = frozenset(e.name for e in EFFECTS.values() if e.identification.likeness)
"""Effects that do what deviations of the parts do: curves, and ripple over a turn."""
NO_CHANCE = 150.0
"""Gain of a set on the mean drive over a smaller one on an individual that no individual reaches."""
COINCIDENCE, COINCIDENCE_PER_PARAMETER = 16.0, 8.0
"""Gain of a name over a single drive at one angle of the crank that chance does not give: a single drive is the less
likely the more sizes of its curve must vanish, but every parameter takes one of them away."""
TOO_WIDE = 2.0
"""Size of the scatter that these tolerances hardly make."""
WIDEST = max(size for size in SIZES if size < TOO_WIDE)


def of_these_tolerances(study: Study, smaller: Fit, fit: Fit) -> Fit:
    """The fit without a name, as of a drive of these tolerances where the name makes it one: a scatter wider than they
    make explains all there is."""
    if smaller.weighting.size < TOO_WIDE or fit.weighting.size >= TOO_WIDE:
        return smaller
    return study.fit_from(smaller.names, smaller.parameters, smaller.weighting.with_size(WIDEST), refit_size=False)


def may_scatter(study: Study, fit: Fit, base: Fit, smaller: Fit, name: str, louder: float) -> bool:
    """Whether this drive may be an individual: it scatters, or the record cannot tell and an individual, or several
    names for what it does by itself, would do hardly worse. smaller: the fit without the name."""
    if fit.weighting.size >= INDIVIDUAL:
        wide = smaller.weighting.size >= TOO_WIDE > fit.weighting.size
        return (name in LIKE_SCATTER and not wide) or (smaller.cost - fit.cost) / louder < 4 * NO_CHANCE
    if stands(study):
        return name in LIKE_SCATTER and _by_chance(study, fit, base, smaller, name, louder)
    if study.mean or name not in SHOWN_BY_A_CURVE or (len(fit.names) == 1 and base.weighting.size < INDIVIDUAL):
        return False
    # What scatters less than any single drive does is none.
    single = smaller if smaller.weighting.size >= INDIVIDUAL else as_individual(study, smaller)
    return (single.cost - fit.cost) / louder < NO_CHANCE


def _by_chance(study: Study, fit: Fit, base: Fit, smaller: Fit, name: str, louder: float) -> bool:
    """Whether names that do what parts do are hardly likelier than a single drive, whose curve at one angle of the
    crank has but a few sizes, or than another form of the effects beside them: each of them, and all together."""
    alike = LIKE_SCATTER & set(fit.names)
    others = frozenset(fit.names) - alike
    plain = study.fit_from(*part_of(study, fit, others)) if others else base
    for without, names in ((smaller, {name}), (plain, alike)):
        least = sum(COINCIDENCE + COINCIDENCE_PER_PARAMETER * len(kernel(n).effect.parameters) for n in names)
        if without.weighting.size >= INDIVIDUAL and without.cost - fit.cost < louder * least:
            return True
    return plain.cost - fit.cost < FORM_ERROR * (base.cost - plain.cost)
