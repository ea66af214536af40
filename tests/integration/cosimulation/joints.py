"""The inertias and dampings of the joints in these tests, and a start out of equilibrium."""

from __future__ import annotations

import numpy as np

from reefmu.joint import JointModel, Masses

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
FREE = Masses(motor_inertia=1e-4, load_inertia=2.0)


def released(joint: JointModel) -> tuple[np.ndarray, np.ndarray]:
    """A start near the equilibrium under 100 N.m, and the torques that hold the equilibrium."""
    start, held = joint.equilibrium(-100.0)
    start[2] += 1e-4
    return start, held
