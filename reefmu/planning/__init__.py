"""Planning of tests: from a drawing, a rig and the effects of interest, the shortest protocol that separates them.

    protocols (rig -> motion_pieces -> schedule) -> diagnosis_link -> information -> rival_hypotheses
    -> predicted_isolability -> design -> remedies -> shortest_plan -> next_experiment | plan_report

`diagnosis_link` alone imports the computations of the diagnosis, whose predictor and covariance a plan uses; `sizes`
are the typical sizes of the effects; `plan_report` writes the files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from .next_experiment import NextProtocol, next_protocol, rig_of_record
    from .protocols.rig import Rig, load_rig
    from .shortest_plan import Plan, make_plan

__all__ = ["NextProtocol", "Plan", "Rig", "load_rig", "make_plan", "next_protocol", "rig_of_record"]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".next_experiment": ("NextProtocol", "next_protocol", "rig_of_record"),
        ".shortest_plan": ("Plan", "make_plan"),
        ".protocols.rig": ("Rig", "load_rig"),
    },
)
