"""What the tests of this folder share: a joint, its drive, and the export's MJCF with other values."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses

MASSES = Masses(1e-4, 1.0)
LOSSY = {
    "backlash": {"clearance": 2e-6},
    "structural_compliance": {"compliance": 5e-6},
    "kinematic_error": {"amplitude_1": 1e-5},
    "hysteresis": {"torque": 4.0, "presliding": 5e-5},
    "coulomb_friction": {"torque": 3.0},
    "viscous_friction": {"coefficient": 2.0},
}


def at_nominal(model: DriveModel) -> DriveModel:
    """All parameters at their nominal size."""
    return model.with_parameters(
        {
            p.name: float(np.clip(p.nominal, p.minimum, p.maximum))
            for p in model.parameters
            if p.tunable and p.minimum is not None and p.maximum is not None
        }
    )


def joint_text(folder: Path, *, integrator: str = "Euler", settings: str = "", **values: float) -> str:
    """The model of an export's joint with other values: `step`, `armature` of the twist, `inertia` of the load."""
    text = (folder / "joint.xml").read_text("utf-8")
    changes = {
        "step": (r'timestep="[^"]*"', 'timestep="{:.9g}"'),
        "armature": (r'(name="joint_twist".*armature=)"[^"]*"', r'\g<1>"{:.9g}"'),
        "inertia": (r'diaginertia="[^"]*"', 'diaginertia="{0:.9g} {0:.9g} {0:.9g}"'),
    }
    for name, value in values.items():
        pattern, replacement = changes[name]
        text, count = re.subn(pattern, replacement.format(value), text)
        assert count == 1, name
    text = text.replace("<option ", f'<option integrator="{integrator}" ')
    return text.replace("</instance>", f"{settings}</instance>") if settings else text
