"""The drive model: the contact lookup and the effects along the drive, as CasADi functions.

* `contacts`: the torque of the contacts as functions, from a drawing, an individual's parts or a curve.
* `stages`: the stages along the drive and their order, as expressions, as the model's functions and in scalars.
* `signals`, `parameters`, `chosen_effects`: inputs, outputs, parameters and effects inside; `drive_model`: the model;
  `model_file`: model.toml.
* `masses`: motor and load of a joint; `buffered`: fast calls of CasADi functions.

Names are loaded when they are first used: a running FMU needs no solver.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from .drive_model import DriveModel, build_curve_model, build_model, describe_effects
    from .parameters import ModelParameter
    from .signals import INPUTS, OUTPUTS, Signal

__all__ = [
    "INPUTS",
    "OUTPUTS",
    "DriveModel",
    "ModelParameter",
    "Signal",
    "build_curve_model",
    "build_model",
    "describe_effects",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".drive_model": ["DriveModel", "build_curve_model", "build_model", "describe_effects"],
        ".parameters": ["ModelParameter"],
        ".signals": ["INPUTS", "OUTPUTS", "Signal"],
    },
)
