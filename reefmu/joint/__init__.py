"""The drive in a robot joint: motor and load inertia, a controller, python-control systems, co-simulation.

* `equations`: the joint in CasADi, around a `DriveModel`; `joint_simulation`: the joint under a controller.
* `systems`: python-control systems of drive and joint, with exact linearisation; `named_system`: their parameters,
  with the system's name as prefix.
* `cosimulation`: the loop around an FMU; `block`: an FMU as a discrete-time block of python-control; `step`: the
  communication step that such a loop allows.
* `controller`: an LQR; `plots`: its behaviour on the drive's real curve.

Names are loaded when they are first used: importing python-control takes a second or two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from reefmu.model.masses import Masses, Scheme

    from .block import FmuBlock, fmu_block, masses_block
    from .cosimulation import cosimulate
    from .equations import JointModel
    from .joint_simulation import Controller, Motion, simulate_joint
    from .step import growth_rate, largest_step, step_warning
    from .systems import drive_system, joint_system, linearize

__all__ = [
    "Controller",
    "FmuBlock",
    "JointModel",
    "Masses",
    "Motion",
    "Scheme",
    "cosimulate",
    "drive_system",
    "fmu_block",
    "growth_rate",
    "joint_system",
    "largest_step",
    "linearize",
    "masses_block",
    "simulate_joint",
    "step_warning",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".block": ("FmuBlock", "fmu_block", "masses_block"),
        ".cosimulation": ("cosimulate",),
        ".equations": ("JointModel",),
        "..model.masses": ("Masses", "Scheme"),
        ".joint_simulation": ("Controller", "Motion", "simulate_joint"),
        ".step": ("growth_rate", "largest_step", "step_warning"),
        ".systems": ("drive_system", "joint_system", "linearize"),
    },
)
