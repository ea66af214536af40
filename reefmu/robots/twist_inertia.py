"""The stiff spring of a drive at the time step of a simulator.

A joint has two coordinates: theta, the motor's angle in terms of the output, and delta, minus the twist; the link turns
with theta + delta, and the drive's torque acts on delta alone. MuJoCo solves M a = f for the accelerations and takes
v' = v + h a, q' = q + h v' (symplectic Euler). With f = -K delta, an eigenmode with (omega h)^2 = x multiplies by the
roots z of

    z^2 - (2 - x) z + 1 = 0,

whose absolute value is 1 for 0 < x < 4 and exceeds 1 beyond. A robot's drive with 300 kN.m/rad and a reduced inertia of
0.08 kg.m2 has x = 15 at 2 ms.

An inertia H added to delta (MJCF: the `armature` of its joint) makes this implicit: (M + H) a = -K delta is
M a = -K (delta + H/K a), which with H = h^2 K/4 is the trapezoidal rule for the spring, because
delta + h^2/4 a = (delta_before + 2 delta + delta_after)/4. For every mode, with any number of drives and links,

    x = h^2 (w K w)/(w M w + w H w) < h^2 K/H,

so that H = h^2 K/S bounds x by S whatever the robot weighs. The force on delta is exact at rest, where a = 0; motions
of the motor and slow motions of the link do not see H. The method remains symplectic: energy oscillates and does not
grow. With S = 4 the fastest mode would be on the limit; `SAFE_PHASE` = 2 leaves half of it for friction, whose
presliding stiffness adds to K, and for velocity-dependent forces. Where the inertia J at delta is known, h^2 K/12 is
better as soon as x stays below S: it cancels the error of the symplectic Euler method in the frequency to fourth order
(Numerov's method),

    (numerical frequency/exact)^2 = 1 + (h^2 K/J) (1/12 - H/(h^2 K)) + O(h^4).

Velocity-dependent torques D d(delta)/dt of the drive are explicit; they need x + 2 h D/(J + H) < 4.
"""

from __future__ import annotations

import math

from reefmu.model.masses import expect_inertia, expect_step
from stiffness_model.errors import expect_number

STABLE_PHASE = 4.0
"""(Eigenfrequency x step)^2 at the stability limit of the symplectic Euler method."""
SAFE_PHASE = 2.0
"""The bound of the same quantity for which inertias are chosen: half the limit, see above."""


def twist_armature(stiffness: float, step: float, *, inertia: float = 0.0) -> float:
    """Inertia, kg.m2, to add to the twist of a drive of this greatest stiffness, N.m/rad, at a time step, s.

    inertia: kg.m2, that acts on the twist without it (`Masses.reduced_inertia` of motor and load); 0 for any robot.
    Raises `InputError` for values out of range.

    >>> f"{twist_armature(3e5, 2e-3):.3g}", f"{twist_armature(3e5, 1e-4, inertia=0.08):.3g}"
    ('0.6', '0.00025')
    """
    k = expect_number(stiffness, "a positive stiffness, N.m/rad", "stiffness", low=0.0)
    h = expect_step(step, "step")
    expect_number(inertia, "an inertia of at least 0 kg.m2", "inertia", low=math.nextafter(0.0, -1.0))
    return h * h * k / SAFE_PHASE if inertia == 0.0 else max(h * h * k / 12, h * h * k / SAFE_PHASE - inertia)


def largest_time_step(stiffness: float, inertia: float, *, armature: float = 0.0) -> float:
    """The longest stable time step, s, of a drive between motor and load; infinite for none.

    stiffness: the greatest, N.m/rad; inertia: reduced inertia of motor and load, kg.m2 at the output; armature: of the
    twist, kg.m2. Raises `InputError` for values out of range.

    >>> f"{largest_time_step(3e5, 0.08):.2e}"
    '1.03e-03'
    """
    k = expect_number(stiffness, "a positive stiffness, N.m/rad", "stiffness", low=0.0)
    expect_number(armature, "an armature of at least 0 kg.m2", "armature", low=math.nextafter(0.0, -1.0))
    return math.sqrt(STABLE_PHASE * (expect_inertia(inertia, "inertia") + armature) / k)


def numerical_frequency(step: float, stiffness: float, inertia: float, *, armature: float = 0.0) -> float:
    """Angular frequency, rad/s, with which the simulator lets the twist oscillate; NaN beyond the stable step."""
    phase = step * step * stiffness / (inertia + armature)
    return 2 / step * math.asin(math.sqrt(phase) / 2) if phase < STABLE_PHASE else math.nan
