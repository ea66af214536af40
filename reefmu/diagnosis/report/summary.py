"""The conclusion in one sentence."""

from __future__ import annotations

from ...effects import find_effect
from ..inference.unnamed import varies_with_something
from ..probabilities.decision import Conclusion
from ..schema import Gap
from .text import sets_text

NOTHING_RECORDED = "nothing that the record holds"
"""With what a remainder varies that shows in no coordinate."""


def summarise(conclusion: Conclusion, gap: Gap, full_torque: float) -> str:
    """The conclusion in one sentence; full_torque: N.m, for the remainder's share."""
    names = " and ".join(f"{find_effect(name).title.lower()} ({name})" for name in conclusion.chosen.names)
    verb = "shrinks" if gap.shrinks else "changes"
    change = f"the gap {verb} from {gap.before:.3g} to {gap.after:.3g} N.m, the noise is {gap.noise:.3g} N.m"
    rest = f"{conclusion.remainder:.3g} N.m ({100 * conclusion.remainder / full_torque:.2g} % of full torque)"
    where = ""
    if conclusion.unnamed:
        found = conclusion.unnamed.term.coordinate if varies_with_something(conclusion.unnamed) else NOTHING_RECORDED
        where = f"; it varies with {found}"
    match conclusion.verdict:
        case "named":
            return f"What is missing is {names}: {change}{_tolerances(conclusion)}."
        case "partly":
            return (
                f"What is missing is {names}: {change}; a remainder of {rest} is left that no known effect "
                f"explains{where}{_tolerances(conclusion)}."
            )
        case "ambiguous":
            others = [names for names in conclusion.shown_alternatives if names]
            doubt = "which" if names and len(others) == len(conclusion.shown_alternatives) else "whether an"
            doubt = f"This record cannot tell {doubt} effect is missing"
            if not names:
                return f"{doubt}: perhaps none is, perhaps {sets_text(others) or 'something unnamed'}."
            and_others = f", and so may {sets_text(others)}" if others else ""
            return f"{doubt}: {names} may explain it ({change}){and_others}."
        case "unknown":
            return (
                f"Something unknown is missing: a remainder of {rest} exceeds noise and tolerance scatter, and no "
                f"known effect explains it{where}."
            )
        case _:
            tolerances = _tolerances(conclusion)
            return f"Nothing is shown to be missing: noise and tolerance scatter explain the record{tolerances}."


def _tolerances(conclusion: Conclusion) -> str:
    """What is put down to the tolerances."""
    found = conclusion.curve_deviation
    if found is None:
        return ""
    return (
        f"; the curve deviates by {found.rms:.3g} N.m rms, as a modulus that is {100 * found.modulus_error:+.2g} % off "
        f"would make it, and as those of individual drives of the drawing do (standard deviation "
        f"{100 * found.population:.2g} %): modulus or tolerance"
    )
