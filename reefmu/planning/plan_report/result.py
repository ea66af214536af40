"""plan.json: the protocol, the predicted probabilities, detection limits, and what cannot be told."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from scipy.special import ndtri

from ...diagnosis.discrimination.predicted_isolability import NAMED, PRIOR_ODDS
from ...effects import find_effect
from ..shortest_plan import Plan

SCHEMA = 1
DETECTION_ERRORS = math.sqrt(2 * math.log(NAMED / (1 - NAMED) / PRIOR_ODDS)) + float(ndtri(NAMED))
"""Standard errors from which an effect is detected with the probability `NAMED` where it has no rival: 3.4 from its
prior odds to the posterior probability at which it is named, and 1.6 for the probability."""


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
                DETECTION_ERRORS * float(plan.isolability.standard_error[k]) * typical,
                None if from_size is None else from_size * typical,
                plan.isolability.named_right(name),
            )
        )
    return found


def summary(plan: Plan) -> str:
    """The result in one or two sentences."""
    told = [name for name in plan.isolability.true if plan.isolability.named_right(name) >= plan.power]
    total, minutes = len(plan.isolability.true), f"{plan.seconds / 60:.0f}"
    text = (
        f"{len(plan.schedule)} runs in {minutes} min name {len(told)} of {total} effects of typical size with a "
        f"probability of {100 * plan.power:.0f} % or more."
    )
    others = [name for name in plan.isolability.true if name not in told]
    return text + (f" Less probable: {', '.join(others)}." if others else "")


def plan_to_dict(plan: Plan) -> dict[str, Any]:
    """The content of plan.json; SI units, degC."""
    found = plan.isolability
    return {
        "schema": SCHEMA,
        "drive": plan.drive.name,
        "rig": asdict(plan.rig),
        "seconds": plan.seconds,
        "power": plan.power,
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
