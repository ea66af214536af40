"""The joints of these tests: their masses, and a start that makes them move."""

from __future__ import annotations

import numpy as np

from reefmu.joint import JointModel, Masses

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
FREE = Masses(motor_inertia=1e-4, load_inertia=2.0)


def released(joint: JointModel) -> tuple[np.ndarray, np.ndarray]:
    """A start beside the equilibrium under 100 N.m, and the torques that hold that."""
    start, held = joint.equilibrium(-100.0)
    start[2] += 1e-4
    return start, held
