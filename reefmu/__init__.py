"""The rolling element eccentric drive as a component: models, FMUs, joints, diagnosis, command line.

    stiffness_model -> model (with effects) -> simulate | fmu | joint | diagnosis -> commands, cli

* `effects`: what the contact model leaves out, one file each; `model`: lookup and effects as CasADi functions.
* `record`, `speed`: measured data; `simulate`: a model over a record or a signal.
* `fmu`: export, import and validation; `joint`: motor, drive and load under control.
* `diagnosis`: where a measured record and the model disagree, and why; `planning`: the test that would tell.
* `robots`: the drive as a plugin of a robot simulator.
* `inspection`: what a record holds, before it is diagnosed.
* `commands`, `cli`: the command line; `progress`, `verbosity`, `source_date`: what its commands share.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from .diagnosis import diagnose_record
    from .fmu.export import export_fmu
    from .fmu.validation.fmu_check import check_fmu
    from .joint import JointModel, Masses, joint_system
    from .model import DriveModel, build_model
    from .model.model_file import load_model, save_model
    from .record import read_record
    from .simulate import simulate_record, simulate_signal

__version__: str
__all__ = [
    "DriveModel",
    "JointModel",
    "Masses",
    "build_model",
    "check_fmu",
    "diagnose_record",
    "export_fmu",
    "joint_system",
    "load_model",
    "read_record",
    "save_model",
    "simulate_record",
    "simulate_signal",
]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".diagnosis": ("diagnose_record",),
        ".fmu.export": ("export_fmu",),
        ".fmu.validation.fmu_check": ("check_fmu",),
        ".joint": ("JointModel", "Masses", "joint_system"),
        ".model": ("DriveModel", "build_model"),
        ".model.model_file": ("load_model", "save_model"),
        ".record": ("read_record",),
        ".simulate": ("simulate_record", "simulate_signal"),
        "stiffness_model.version": ("__version__",),
    },
)
