"""Planning of tests: from a drawing, a rig and the effects of interest, the shortest protocol that separates them.

    protocols (rig -> motion_pieces -> schedule) -> diagnosis_link -> information -> design -> setting -> checked_choice
    -> remedies -> shortest_plan -> next_experiment | plan_report -> proposal

A plan uses the predictor and the covariance of the diagnosis: `diagnosis_link` applies them to records that are not
measured yet, and `reefmu.diagnosis.probabilities` predicts which effects such a record tells apart. `plan_report`
writes the files; `proposal` plans the next experiment of a diagnosis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from .next_experiment import NextProtocol, next_protocol, rig_of_record
    from .proposal import propose_protocol
    from .protocols.rig import Rig, load_rig
    from .shortest_plan import Plan, make_plan

__all__ = ["NextProtocol", "Plan", "Rig", "load_rig", "make_plan", "next_protocol", "propose_protocol", "rig_of_record"]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".next_experiment": ("NextProtocol", "next_protocol", "rig_of_record"),
        ".proposal": ("propose_protocol",),
        ".shortest_plan": ("Plan", "make_plan"),
        ".protocols.rig": ("Rig", "load_rig"),
    },
)
