"""The C file `stage_order.c`: the calls of the drive's stages, in the order that `reefmu.model.stages.order` declares.

It is generated for every model, with the stages that this model has. `model.c` includes it and provides what it calls:
`RUN` evaluates a generated function, `next_states` returns a buffer for a result, `solve_at` solves the contacts at a
contact point.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from .functions import GeneratedFunctions

if TYPE_CHECKING:
    from reefmu.model.stages.order import Stage

STAGE_ORDER = "stage_order.c"
"""Name of the file among the sources."""
_READS = {"x": "at->x", "u": "at->u", "k": "at->k", "p": "at->p", "dt": "&dt", "c": "at->contact.outputs"}
"""The C expressions of the quantities that the stages read."""


def stage_order(functions: GeneratedFunctions) -> str:
    """The text of the file for one component."""
    from reefmu.model.stages.order import ADVANCE_TIME, CONTACT_EQUILIBRIUM, KINEMATICS, OUTPUT, RATE, SETTLE

    follow = tuple(stage for stage in functions.stages.advance_order if stage is not ADVANCE_TIME)
    drift = (*functions.drift_angles, *functions.stages.advance_order)
    settle = (
        "/* States after the torque has been held for long, likewise. */\n"
        "static inline void settle_states(Instance *instance, Evaluation *at) {\n"
        f"{_calls([SETTLE], functions, contacts_known=True)}}}\n\n"
        if SETTLE.name in functions.functions
        else ""
    )
    unused = "dt" if drift else "instance, (void)at, (void)dt"
    return (
        "/* The order of the drive's stages. Generated from the declaration in reefmu/model/stages/order.py. */\n\n"
        "/* Twist at the present angles. */\n"
        "static void evaluate_kinematics(Instance *instance, Evaluation *at) {\n"
        f"{_calls([KINEMATICS], functions)}}}\n\n"
        "/* Outputs of the contacts at the present states. */\n"
        "static const double *evaluate_contacts(Instance *instance, Evaluation *at) {\n"
        f"{_calls(CONTACT_EQUILIBRIUM, functions)}    return at->contact.outputs;\n}}\n\n"
        "/* Outputs and rates, once the contacts are evaluated. */\n"
        "static void evaluate_output(Instance *instance, Evaluation *at, double *y) {\n"
        f"{_calls([OUTPUT], functions, contacts_known=True)}}}\n\n"
        "static void evaluate_rate(Instance *instance, Evaluation *at, double *dx) {\n"
        f"{_calls([RATE], functions, contacts_known=True)}}}\n\n"
        f"{settle}"
        "/* States that follow the angles, after a jump of these to the inputs. */\n"
        "static inline void follow_angles(Instance *instance, Evaluation *at) {\n"
        f"    (void)instance, (void)at;\n{_calls(follow, functions)}}}\n\n"
        "/* States after dt seconds at constant inputs. */\n"
        "static void apply_drift(Instance *instance, Evaluation *at, double dt) {\n"
        f"    (void){unused};\n{_calls(drift, functions)}}}\n"
    )


def _calls(order: Sequence[Stage], functions: GeneratedFunctions, *, contacts_known: bool = False) -> str:
    return "".join(f"    {line}\n" for line in _lines(order, functions, contacts_known))


def _lines(order: Sequence[Stage], functions: GeneratedFunctions, contacts_known: bool) -> Iterator[str]:
    """One call per stage. A stage that does not depend on the contacts gets NULL where they are not known."""
    from reefmu.model.stages.order import COEFFICIENTS, CONTACT_POINT, CONTACTS

    for stage in order:
        if stage is COEFFICIENTS:
            continue  # instance->coefficients, which `update_coefficients` keeps
        if stage is CONTACTS:
            yield "solve_at(instance, at, q);"
            contacts_known = True
            continue
        reads = ", ".join(
            "NULL" if name == "c" and not contacts_known else _READS[name] for name in functions.reads[stage.name]
        )
        if stage is CONTACT_POINT:
            yield "double q[N_CONTACT_POINT];"
            yield f"RUN({stage.name}, q, {reads});"
        elif stage.writes == "x":
            yield f"at->x = RUN({stage.name}, next_states(instance, at), {reads});"
        else:
            yield f"RUN({stage.name}, {'at->k' if stage.writes == 'k' else stage.writes}, {reads});"
