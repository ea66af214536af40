"""The drive model: the contact lookup plus effects in their places, as CasADi functions.

* `tables`, `contact`, `individual`, `curve_table`: the contacts' torque as functions, from a drawing or a curve.
* `assembly`, `stages`: the order of the effects along the drive, as one function and cut at the tables.
* `drive_model`: the model with its signals and parameters; `model_file`: model.toml; `masses`: motor and load;
  `buffered`: fast calls.

Names are loaded when they are first used: an FMU that runs needs no solver.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from .drive_model import (
        INPUTS,
        OUTPUTS,
        DriveModel,
        ModelParameter,
        Signal,
        build_curve_model,
        build_model,
        describe_effects,
    )

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

__getattr__, __dir__ = lazy_names(__name__, {".drive_model": __all__})
