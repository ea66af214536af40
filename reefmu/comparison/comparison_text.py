"""The comparison as plain text: a line for each change, then what a reader must know."""

from __future__ import annotations

from stiffness_model.units import displayed

from .state_changes import Change, Estimate, StateComparison


def estimate_text(estimate: Estimate, signed: bool = False) -> str:
    """Value, interval and unit.

    >>> estimate_text(Estimate(1.25, 0.5, 2.0, "N.m"), signed=True)
    '+1.25 (+0.5 to +2) N.m'
    """
    form, unit = "+.3g" if signed else ".3g", displayed(0.0, estimate.unit)[1]
    value, low, high = (
        format(displayed(x, estimate.unit)[0], form) for x in (estimate.value, estimate.low, estimate.high)
    )
    return f"{value} ({low} to {high})" + ("" if unit == "1" else f" {unit}")


def probability_up_text(probability: float) -> str:
    """A probability that the sample of the posterior resolves.

    >>> probability_up_text(0.99997), probability_up_text(0.42), probability_up_text(0.0)
    ('> 0.999', '0.42', '< 0.001')
    """
    if probability > 0.999:
        return "> 0.999"
    return "< 0.001" if probability < 0.001 else f"{probability:.3g}"


def direction_text(comparison: StateComparison, change: Change) -> str:
    """The direction, with a reservation where the interval does not count what positions differ by."""
    one_position = comparison.basis[change.quantity] == "cycles" and change.direction != "not decided"
    return f"{change.direction}{' at this position' if one_position else ''}"


def shown_changes(comparison: StateComparison) -> list[Change]:
    """Changes from each state to the next, and from the first state to the last."""
    names = [state.name for state in comparison.states]
    order = {name: k for k, name in enumerate(names)}
    return [change for change in comparison.changes if order[change.end] - order[change.start] in (1, len(names) - 1)]


def comparison_text(comparison: StateComparison) -> str:
    """What the command prints."""
    lines = [f"loads up to {comparison.load:.3g} N.m, which all cycles reach"]
    for state in comparison.states:
        lines.append(f"{state.name}: {_count(state.positions, 'position')}, {_count(state.cycles, 'cycle')}")
    width = max((len(direction_text(comparison, change)) for change in comparison.changes), default=0)
    longest = max((len(change.quantity) for change in comparison.changes), default=0)
    pair = ("", "")
    for change in shown_changes(comparison):
        if (change.start, change.end) != pair:
            pair = change.start, change.end
            lines += ["", f"{change.start} -> {change.end}"]
        size = estimate_text(change.difference, signed=True)
        up = probability_up_text(change.probability_up)
        direction = direction_text(comparison, change)
        lines.append(f"  {change.quantity:<{longest}}  {direction:<{width}}  {size}, probability of up {up}")
    return "\n".join([*lines, "", *(f"note: {note}" for note in comparison.notes)]).rstrip()


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' if number != 1 else ''}"
