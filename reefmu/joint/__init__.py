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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reefmu.model.masses import Masses, Scheme

    from .block import FmuBlock, fmu_block, masses_block
    from .cosimulation import cosimulate
    from .equations import JointModel
    from .simulate import Controller, Motion, simulate_joint
    from .step import growth_rate, largest_step, step_warning
    from .systems import drive_system, joint_system, linearize

_HOMES = {
    "FmuBlock": ".block",
    "fmu_block": ".block",
    "masses_block": ".block",
    "cosimulate": ".cosimulation",
    "JointModel": ".equations",
    "Masses": "..model.masses",
    "Scheme": "..model.masses",
    "Controller": ".simulate",
    "Motion": ".simulate",
    "simulate_joint": ".simulate",
    "growth_rate": ".step",
    "largest_step": ".step",
    "step_warning": ".step",
    "drive_system": ".systems",
    "joint_system": ".systems",
    "linearize": ".systems",
}

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


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name], __name__), name)
