"""Texts of the report: verdicts, sizes, locations and cautions in words."""

from __future__ import annotations

from collections.abc import Sequence

from stiffness_model.units import interval_text, quantity_text

from ..fitted_values import AmplitudeTest, CrankLosses, EfficiencyAtLoad, NamedEffect, ParameterAtBound
from ..schema import Diagnosis, Location

MEANING = {
    "named": "the missing effects are identified",
    "partly": "effects are identified, and something else is missing",
    "ambiguous": "several explanations fit, which this record cannot tell apart",
    "none": "nothing is shown to be missing",
    "unknown": "something is missing that no known effect explains",
    "insufficient": "the record does not allow a diagnosis",
}
"""What each verdict means."""
CALIBRATION = (
    "Probabilities are frequencies, calibrated on simulated records of drives from drawings: of 100 explanations with "
    "80 %, about 80 are true."
)
"""What the probabilities mean."""
POOR_FIT = 0.01
"""p-value below which the chosen model does not explain the record: the usual level of 1 %."""
DISAGREEMENT = 0.05
"""p-value below which sizes of small and large cycles are said to disagree: the usual level of 5 %; the report and
diagnosis.json state all."""
LARGE_GAP_RATIO = 1.5
"""Gap that is left, over the noise, from which a caution is given; chosen by judgement."""
RAW_GAP_RATIO = 1.1
"""Gap with the angles as measured, over that without their noise, from which a caution is given; chosen by
judgement."""
OWN_SCATTER_RATIO = 0.9
"""Gap without this drive's scatter, over the gap, below which the scatter explains part of it; chosen by judgement."""
MAX_LISTED = 3
"""Other explanations that are listed at most, for a reader's sake."""


def sets_text(alternatives: Sequence[Sequence[str]], most: int = MAX_LISTED) -> str:
    """Sets of effects in words, the first of them.

    >>> sets_text([("creep",), ("wear", "preload")])
    'creep, or wear and preload'
    >>> sets_text([("creep",), (), ("damping",)], 2)
    'creep, or nothing, or one of 1 other'
    """
    words = [" and ".join(names) or "nothing" for names in alternatives[:most]]
    left = len(alternatives) - most
    if left > 0:
        words.append(f"one of {left} other{'s' if left > 1 else ''}")
    return ", or ".join(words)


def faint_alternatives_text(diagnosis: Diagnosis) -> str:
    """How many of the alternatives hold an effect that does not show; empty without one."""
    count = len(diagnosis.alternatives) - len(diagnosis.shown_alternatives)
    if count < 1:
        return ""
    sets = "another set of effects" if count == 1 else f"{count} other sets of effects"
    return f"{sets} with one that is too small for this record to show"


def main_parameter_text(effect: NamedEffect) -> str:
    """The parameter that is the size of an effect, with its interval; of a kinematic error the largest order."""
    sizes = {name: v for name, v in effect.parameters.items() if not name.startswith("phase")}
    name = next(iter(sizes))
    if name.startswith("amplitude"):
        name = max((n for n in sizes if n.startswith("amplitude")), key=lambda n: abs(sizes[n].value))
    value = sizes[name]
    interval = interval_text(value.low, value.high, value.unit)
    return f"{name.replace('_', ' ')} {quantity_text(value.value, value.unit)} (95 %: {interval})"


def global_p_text(p: float) -> str:
    """The p-value of the chosen model in words.

    >>> global_p_text(0.31)
    'The chosen model explains the record: p = 0.31.'
    >>> global_p_text(0.0001)
    'The chosen model does not explain the record: p < 0.001.'
    """
    explains = "does not explain" if p < POOR_FIT else "explains"
    return f"The chosen model {explains} the record: p {'< 0.001' if p < 0.001 else f'= {p:.2g}'}."


def location_text(location: Location) -> str:
    """A location in words."""
    name = location.coordinate.replace("_", " ")
    return location.region if name == "crank angle" else f"{name}, strongest at {location.region}"


def file_name(source: str) -> str:
    """The file names of a path, or of several joined by commas, of POSIX or Windows."""
    return ", ".join(part.replace("\\", "/").rsplit("/", 1)[-1] for part in source.split(", "))


def bound_text(found: ParameterAtBound) -> str:
    """A parameter at its bound in words.

    >>> bound_text(ParameterAtBound("exponent", "high", 6.0, 5.2, None, "1", "play acts like a larger exponent"))
    'exponent ended at its upper bound, 6 (95 %: at least 5.2): play acts like a larger exponent'
    """
    end = "lower" if found.bound == "low" else "upper"
    name = found.parameter.split(" [")[0].replace("_", " ").replace(".", ": ")
    limit = ""
    if found.high is not None:
        limit = f" (95 %: at most {quantity_text(found.high, found.unit)})"
    elif found.low is not None:
        limit = f" (95 %: at least {quantity_text(found.low, found.unit)})"
    return f"{name} ended at its {end} bound, {quantity_text(found.value, found.unit)}{limit}: {found.meaning}"


def amplitude_text(test: AmplitudeTest) -> str:
    """How the size of an effect differs between small and large cycles, in words."""
    sizes = ", ".join(
        f"{quantity_text(s.value, test.unit)} ({interval_text(s.low, s.high, test.unit)}) at {s.amplitude:.3g} N.m"
        for s in test.sizes
    )
    p = "p < 0.001" if test.p < 0.001 else f"p = {test.p:.2g}"
    text = f"{test.effect}: {test.parameter} differs with the amplitude of the cycles: {sizes} ({p})"
    if test.power is not None:
        text += (
            f"; it grows with the power {test.power:.2g} ({test.power_low:.2g} ... {test.power_high:.2g}) of the "
            "amplitude"
        )
    return text + (f", which {' or '.join(test.laws)} would reconcile" if test.laws else "")


def efficiency_text(at: EfficiencyAtLoad) -> str:
    """Efficiencies at one load in words; a drive that locks itself has none with the output driving."""
    driving, back = at.driving, at.driven_back
    reverse = (
        f"{100 * back.value:.1f} % ({100 * back.low:.1f} ... {100 * back.high:.1f}) driven back"
        if back.value > 0
        else "locked against the output"
    )
    return (
        f"efficiency at {at.load:.3g} N.m and {at.speed:.3g} rad/s of the crank {100 * at.driving.value:.1f} % "
        f"({100 * driving.low:.1f} ... {100 * driving.high:.1f}) driving, {reverse}"
    )


def losses_text(losses: CrankLosses) -> str:
    """Friction at the crank in one line: its parameters, and the efficiencies at full load."""
    sizes = [
        f"{name} {quantity_text(value.value, value.unit)} ({interval_text(value.low, value.high, value.unit)})"
        for name, value in losses.parameters.items()
    ]
    full = [efficiency_text(at) for at in losses.efficiencies[-1:]]
    return f"friction at the crank, from both torques: {'; '.join([', '.join(sizes), *full])}"


def sensor_text(losses: CrankLosses) -> list[str]:
    """What is wrong with the torques, where the interval of it excludes that nothing is."""
    found = []
    scale, offset = losses.sensors.get("scale"), losses.sensors.get("offset")
    if scale is not None and not scale.low <= 1 <= scale.high:
        found.append(
            f"the motor's torque is {scale.value:.3f} ({scale.low:.3f} ... {scale.high:.3f}) times what that at the "
            "output asks for in both directions of power: the torque constant, a sensor's scale or the ratio is wrong"
        )
    if offset is not None and not offset.low <= 0 <= offset.high:
        found.append(
            f"the motor's torque is {quantity_text(offset.value, offset.unit)} "
            f"({interval_text(offset.low, offset.high, offset.unit)}) too large in both directions of motion: one of "
            "both torques has an offset"
        )
    return found


def no_model_text(diagnosis: Diagnosis) -> str:
    """Why there is no corrected model although effects are named; empty where there is one."""
    gap = diagnosis.gap
    if diagnosis.has_model or not diagnosis.effects:
        return ""
    return (
        f"the gap does not shrink ({gap.before:.3g} to {gap.after:.3g} {gap.unit}): what is named is significant only "
        "beside the scatter of the tolerances, which no model has; no corrected model is written"
    )


def cautions(diagnosis: Diagnosis) -> list[str]:
    """What a reader must know before relying on the numbers."""
    lines = [bound_text(found) for found in diagnosis.at_bounds]
    lines += [
        f"{effect.name}: {name.replace('_', ' ')} is only known to be within "
        f"{interval_text(value.low, value.high, value.unit)} (95 %)"
        for effect in diagnosis.effects
        for name, value in effect.parameters.items()
        if value.warning and not value.bound
    ]
    lines += [amplitude_text(test) for test in diagnosis.amplitudes if test.p < DISAGREEMENT]
    if diagnosis.global_p is not None and diagnosis.global_p < POOR_FIT:
        lines.append(
            "a record that the chosen model describes would hardly deviate as much as this one: probabilities and "
            "intervals assume that the model is right"
        )
    if diagnosis.losses is not None:
        lines += [*sensor_text(diagnosis.losses), *diagnosis.losses.assumptions]
    gap = diagnosis.gap
    if refusal := no_model_text(diagnosis):
        lines.append(refusal)
    elif (
        diagnosis.effects
        and gap.held_out_after is not None
        and gap.held_out_before is not None
        and gap.held_out_after >= gap.held_out_before
    ):
        lines.append("in runs that were not fitted the gap does not shrink")
    if gap.raw_after is not None and gap.raw_after > RAW_GAP_RATIO * gap.after:
        lines.append(
            f"simulated with the angles as measured the gap is {gap.raw_after:.3g} N.m instead of {gap.after:.3g} N.m: "
            "the noise of the angles moves friction back and forth"
        )
    if diagnosis.verdict in ("named", "ambiguous", "none") and gap.after > LARGE_GAP_RATIO * gap.noise:
        own = gap.after_own_scatter
        why = (
            ""
            if own is None or own > OWN_SCATTER_RATIO * gap.after
            else f"; without the likeliest scatter of this drive, {own:.3g} N.m"
        )
        lines.append(
            f"the gap that is left, {gap.after:.3g} N.m, is {gap.after / max(gap.noise, 1e-300):.1f} times the noise"
            f"{why}"
        )
    return lines
