"""The communication step that a co-simulation around the drive allows.

Two inertias and a spring K, in terms of the twist: reduced inertia J at the output, omega = sqrt(K/J), a = omega h.
With q = (twist, h twist rate, h^2 torque/J) a step of the loop maps q to M q; the amplitude is multiplied by |z| each
step, z the greatest eigenvalue of M, and so grows at the rate ln|z|/h.

parallel: the inertias move exactly under a held torque; the new torque is that of the twist before the step:
    twist' = twist + v - tau/2,  v' = v - tau,  tau' = a^2 twist,    so    z (z - 1)^2 + a^2 (z + 1)/2 = 0
For small a: rate = 3/4 omega^2 h. A torque with the delay T adds energy like a negative damper K T; here T = 3/2 h, one
step of delay and half a step of hold.

sequential (velocity Verlet): z^2 - (2 - a^2) z + 1 = 0, |z| = 1 up to a = 2.
extrapolated: the spring is integrated exactly, |z| = 1 for every step in which K is constant.
"""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from reefmu.model.masses import Scheme
from stiffness_model.errors import expect_number, unknown_name

FASTEST_GROWTH = 1.39
"""a = omega h at which the growth rate of `parallel` is greatest: the maximum of ln|z|/a, found numerically."""


def growth_rate(step: float, stiffness: float, inertia: float, *, scheme: Scheme = "parallel") -> float:
    """Growth rate, 1/s, of a free oscillation of the twist that the coupling causes.

    The amplitude is multiplied by exp(rate t). step: s; stiffness: N.m/rad at the output; inertia: kg.m2 at the
    output, from `Masses.reduced_inertia`. Raises `InputError`, also for an unknown scheme.

    >>> round(growth_rate(1e-4, 1e4, 0.1), 2)  # 3/4 omega^2 h = 7.5
    7.49
    """
    h = expect_number(step, "a positive step, s", "step", low=0.0)
    omega = _eigenfrequency(stiffness, inertia, scheme)
    a = omega * h
    if scheme == "extrapolated" or (scheme == "sequential" and a <= 2):
        return 0.0
    square = a * a
    polynomial = [1.0, square - 2, 1.0] if scheme == "sequential" else [1.0, -2.0, 1 + square / 2, square / 2]
    return math.log(np.abs(np.roots(polynomial)).max()) / h


def largest_step(
    stiffness: float, inertia: float, *, growth: float = 1.0, decay: float = 0.0, scheme: Scheme = "parallel"
) -> float:
    """The longest step, s, at which an oscillation grows by no more than exp(growth) per second.

    stiffness: N.m/rad at the output, of the highest torque, where the joint oscillates fastest; inertia: kg.m2 at the
    output; growth: 1/s; decay: 1/s, of the joint's own damping (damping ratio x eigenfrequency), which compensates
    growth. Infinite for the scheme "extrapolated".

    >>> f"{largest_step(1e4, 0.1, growth=1.0):.2e}"
    '1.33e-05'
    """
    expect_number(growth, "a growth rate of at least 0 1/s", "growth", low=np.nextafter(0.0, -1.0))
    expect_number(decay, "a decay rate of at least 0 1/s", "decay", low=np.nextafter(0.0, -1.0))
    bound = expect_number(growth + decay, "a positive growth or decay rate, 1/s", "growth + decay", low=0.0)
    omega = _eigenfrequency(stiffness, inertia, scheme)
    if scheme == "extrapolated":
        return math.inf
    if scheme == "sequential":
        return 2 / omega
    low, high = 0.0, FASTEST_GROWTH / omega
    if growth_rate(high, stiffness, inertia) <= bound:
        return high
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if growth_rate(middle, stiffness, inertia) <= bound else (low, middle)
    return low


def step_warning(step: float, stiffness: float, inertia: float, *, growth: float = 1.0, decay: float = 0.0) -> str:
    """A warning if the joint's oscillation would grow faster than `growth`, 1/s, with a parallel master; else "".

    For the export, with the step that the FMU proposes and the highest stiffness of the drive.
    """
    limit = largest_step(stiffness, inertia, growth=growth, decay=decay)
    if step <= limit:
        return ""
    rate = growth_rate(step, stiffness, inertia) - decay
    return (
        f"communication step {step:.3g} s: a master that holds the drive's torque over a step lets an oscillation "
        f"of {math.sqrt(stiffness / inertia) / (2 * math.pi):.3g} Hz grow by exp({rate:.3g} t/s); expected at most "
        f"{limit:.2g} s, or a master that uses the stiffness output"
    )


def _eigenfrequency(stiffness: float, inertia: float, scheme: str) -> float:
    if scheme not in get_args(Scheme):
        raise unknown_name("scheme", scheme, get_args(Scheme))
    k = expect_number(stiffness, "a positive stiffness, N.m/rad", "stiffness", low=0.0)
    return math.sqrt(k / expect_number(inertia, "a positive inertia, kg.m2", "inertia", low=0.0))
