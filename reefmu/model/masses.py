"""Motor and load of a joint: two inertias with linear damping, and their exact motion over a step."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from stiffness_model.errors import expect_number
from stiffness_model.numerics.arrays import Array

Scheme = Literal["parallel", "sequential", "extrapolated"]
"""How an importer couples the inertias with the FMU of a drive; see `reefmu.joint.cosimulate`."""

INERTIAS = (1e-12, 1e9)
"""kg.m2: from 1 mg at 1 mm to 10 000 t at 10 m; chosen by judgement. Beyond them rounding errors dominate."""
DAMPINGS = (0.0, 1e12)
"""N.m.s/rad; the upper bound, chosen by judgement, turns at 1 MN.m once in 73 days."""
STEPS = (1e-9, 86400.0)
"""s: communication steps, from far below the time of sound through an element (some us) to a day; by judgement."""

STATES = ("crank.phi", "crank.w", "output.phi", "output.w")
"""Mechanical states of a joint in their order: rad, rad/s."""


@dataclass(frozen=True)
class Masses:
    """Inertias and dampings on both sides of the drive.

    motor_inertia: kg.m2 at the crank; load_inertia: kg.m2 at the output; motor_damping, load_damping: N.m.s/rad at the
    same shafts. Raises `InputError` for values out of `INERTIAS` and `DAMPINGS`.
    """

    motor_inertia: float
    load_inertia: float
    motor_damping: float = 0.0
    load_damping: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("inertia"):
                expect_inertia(value, field.name)
            else:
                _expect_within(value, DAMPINGS, "a damping", "N.m.s/rad", field.name)

    def reduced_inertia(self, ratio: float) -> float:
        """Reduced inertia, kg.m2 at the output, of the oscillation of both inertias against each other.

        ratio: crank to output. With the drive's stiffness K the eigenfrequency is sqrt(K/inertia), rad/s.

        >>> round(Masses(1e-4, 2.0).reduced_inertia(-29), 5)
        0.08071
        """
        return 1 / (1 / (self.motor_inertia * ratio**2) + 1 / self.load_inertia)

    def matrices(self, ratio: float = 1.0, stiffness: float = 0.0) -> tuple[Array, Array]:
        """A (4, 4) and B (4, 2) of ds/dt = A s + B tau, s in the order of `STATES`.

        tau: torques on crank and output, N.m. stiffness: of a linear spring between them, N.m/rad at the output,
        without torque at crank.phi/ratio = output.phi.
        """
        a, b = np.zeros((4, 4)), np.zeros((4, 2))
        a[0, 1] = a[2, 3] = 1.0
        a[1, 1], a[3, 3] = -self.motor_damping / self.motor_inertia, -self.load_damping / self.load_inertia
        b[1, 0], b[3, 1] = 1 / self.motor_inertia, 1 / self.load_inertia
        twist = np.array([1 / ratio, 0.0, -1.0, 0.0])
        return a + np.outer(b @ np.array([-1 / ratio, 1.0]), stiffness * twist), b

    def step_matrices(self, step: float, ratio: float = 1.0, stiffness: float = 0.0) -> tuple[Array, Array]:
        """Exact Phi (4, 4) and Gamma (4, 2) of s(t + step) = Phi s + Gamma tau with held torques.

        step: s. ratio: of the drive, crank to output; stiffness: of a spring between the masses, N.m/rad at the output.
        """
        a, b = self.matrices(ratio, stiffness)
        # Scaled to angles at the output, angles per step, and torques to the angles that they cause in a step: then
        # only damping or stiffness x step^2 can make an entry large.
        size = np.array(
            [ratio, ratio / step, 1.0, 1 / step, self.motor_inertia * ratio / step**2, self.load_inertia / step**2]
        )
        block = np.zeros((6, 6))
        block[:4, :4], block[:4, 4:] = a * step, b * step
        whole = _exponential(block / size[:, None] * size) * size[:, None] / size
        return whole[:4, :4], whole[:4, 4:]


def expect_inertia(value: object, where: str) -> float:
    """The inertia, kg.m2. Raises `InputError` out of `INERTIAS`, wherever an inertia is given."""
    return _expect_within(value, INERTIAS, "a positive inertia", "kg.m2", where)


def expect_step(value: object, where: str) -> float:
    """The communication step, s. Raises `InputError` out of `STEPS`."""
    return _expect_within(value, STEPS, "a positive communication step", "s", where)


def _expect_within(value: object, bounds: tuple[float, float], what: str, unit: str, where: str) -> float:
    low, high = bounds
    return expect_number(
        value,
        f"{what} within {low:g} ... {high:g} {unit}",
        where,
        low=np.nextafter(low, -np.inf),
        high=np.nextafter(high, np.inf),
    )


TYPICAL_MASSES = Masses(1e-4, 1.0)
"""Inertias of a robot joint, assumed where none are given; chosen by judgement. An importer may set others."""


def _exponential(a: Array) -> Array:
    """Matrix exponential by scaling, Taylor series and squaring (Moler, Van Loan, 2003, method 3).

    SciPy's function calls a threaded solver, which takes a hundred times as long for so small a matrix on a busy
    machine.
    """
    norm = float(np.abs(a).sum(axis=1).max())
    squarings = max(0, math.ceil(math.log2(norm))) if norm > 0 else 0
    scaled = a / 2.0**squarings
    total, term = np.eye(len(a)), np.eye(len(a))
    for k in range(1, 19):  # 1/19! is below the rounding of double precision
        term = term @ scaled / k
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total
