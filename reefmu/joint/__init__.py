"""The drive in a robot joint: motor and load inertia, a controller, python-control systems, co-simulation.

* `equations.py` writes the joint once, in CasADi, over a `DriveModel`; `simulate.py` runs it under a controller.
* `systems.py` makes python-control systems of drive and joint, with exact linearisation; `parameters.py` keeps their
  parameters apart in an interconnection.
* `cosimulation.py` is the loop around an FMU, `block.py` the FMU as a discrete block of python-control.
* `step.py` derives which communication step such a loop allows.
* `controller.py` designs an LQR, `plots.py` draws what the drive's real curve does to it.

Names are loaded when they are first used: importing control alone takes a second or two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from reefmu.model.masses import Masses, Scheme

    from .block import FmuBlock, fmu_block, masses_block
    from .cosimulation import cosimulate
    from .equations import JointModel
    from .simulate import Controller, Motion, simulate_joint
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
        ".simulate": ("Controller", "Motion", "simulate_joint"),
        ".step": ("growth_rate", "largest_step", "step_warning"),
        ".systems": ("drive_system", "joint_system", "linearize"),
    },
)
