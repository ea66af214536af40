"""plan.json: the protocol, the predicted probabilities, detection limits, and what cannot be told."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from ...effects import find_effect
from ...effects.base import Requirement
from ..checked_choice import Ended
from ..design import wanted_separations
from ..protocols.schedule import duration_text
from ..remedies import Remedy
from ..shortest_plan import Plan

SCHEMA = 1
DETECTED = 0.95
"""Probability with which an effect without rivals is detected from its detection limit on."""
COLUMN_SENSORS = {
    Requirement.TEMPERATURE: "a sensor of the drive's temperature",
    Requirement.CRANK_ANGLE: "an encoder at a crank whose angle can be set",
}
"""What measures a column without which an effect is no candidate."""


@dataclass(frozen=True)
class Limit:
    """Sizes of one effect, SI: typical, from which it is detected beside noise and scatter, and from which it is named
    with the plan's power; None where it is named from none.
    """

    effect: str
    parameter: str
    unit: str
    typical: float
    detected_from: float
    named_from: float | None
    named_at_typical: float


def limits(plan: Plan) -> list[Limit]:
    """The limits of every effect of interest."""
    found: list[Limit] = []
    errors = math.sqrt(wanted_separations(DETECTED)[0])
    for k, name in enumerate(plan.isolability.true):
        key = next(key for key in plan.sizes if key.startswith(name + "."))
        parameter = next(p for p in find_effect(name).parameters if f"{name}.{p.name}" == key)
        typical, from_size = plan.sizes[key], plan.isolability.named_from(name, plan.power)
        found.append(
            Limit(
                name,
                parameter.name,
                parameter.unit,
                typical,
                errors * float(plan.isolability.standard_error[k]) * typical,
                None if from_size is None else from_size * typical,
                plan.isolability.named_right(name),
            )
        )
    return found


def summary(plan: Plan) -> str:
    """The result in two or three sentences: what the protocol names, what it names less often, and why it ends."""
    right = {name: plan.isolability.named_right(name) for name in plan.isolability.true}
    told, count = sum(p >= plan.power for p in right.values()), len(plan.schedule)
    runs, verb = ("run", "names") if count == 1 else ("runs", "name")
    effects = f"{told} of {len(right)} effects" if len(right) > 1 else f"{told} of 1 effect"
    text = (
        f"{count} {runs} in {duration_text(plan.seconds)} {verb} {effects} of typical size with a probability of "
        f"{100 * plan.power:.0f} % or more."
    )
    others = [f"{name} ({100 * p:.0f} %)" for name, p in right.items() if p < plan.power]
    text += f" Less probable: {', '.join(others)}." if others else ""
    return f"{text} {end_text(plan)}"


def end_text(plan: Plan) -> str:
    """Why the protocol has no more runs, in a sentence."""
    match plan.ended:
        case Ended.REACHED:
            return "No further run is needed."
        case Ended.TIME:
            return f"No further run that would help fits into the {duration_text(60 * plan.rig.minutes)} allowed."
        case Ended.NOTHING:
            return f"No further run on this rig would bring the others to {100 * plan.power:.0f} %."


def untold_text(remedy: Remedy) -> str:
    """One effect that the protocol does not tell from a rival, and what could, as part of a sentence."""
    could = f"; {remedy.remedy} could" if remedy.remedy else ""
    return f"{remedy.effect} cannot be reliably distinguished from {remedy.rival}{could}"


def remedy_for_excluded(name: str) -> str:
    """What would show an effect that is no candidate: the column that its records lack, or a test of its own."""
    effect = find_effect(name)
    lacking = [COLUMN_SENSORS[need] for need in effect.identification.requirements if need in COLUMN_SENSORS]
    if lacking and not effect.identification.not_a_candidate:
        return " and ".join(lacking)
    return f"no sensor; a test of it alone: {effect.excitation[0].lower()}{effect.excitation[1:].rstrip('.')}"


def plan_to_dict(plan: Plan) -> dict[str, Any]:
    """The content of plan.json; SI units, degC."""
    found = plan.isolability
    return {
        "schema": SCHEMA,
        "drive": plan.drive.name,
        "rig": asdict(plan.rig),
        "seconds": plan.seconds,
        "power": plan.power,
        "ended": plan.ended.value,
        "runs": [
            {"run": k + 1, "begin": float(begin), "seconds": piece.seconds, "what": piece.label}
            for k, (begin, piece) in enumerate(zip(plan.schedule.begin, plan.schedule.pieces, strict=True))
        ],
        "isolability": {
            "true": ["", *found.true],
            "named": [*found.names, ""],
            "matrix": [[round(float(p), 4) for p in row] for row in found.matrix],
        },
        "limits": [asdict(limit) for limit in limits(plan)],
        "power_by_size": {
            "sizes": [float(x) for x in found.sizes],
            "probability": {
                name: [round(float(p), 4) for p in row] for name, row in zip(found.true, found.power, strict=True)
            },
        },
        "cannot_tell": [asdict(remedy) for remedy in plan.remedies],
        "excluded": dict(plan.excluded),
    }


def plan_json(plan: Plan) -> str:
    """The text of plan.json."""
    return json.dumps(plan_to_dict(plan), indent=1, allow_nan=False) + "\n"
