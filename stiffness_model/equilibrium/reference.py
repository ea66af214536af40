"""The paper's method for the equilibrium of one element: an independent check of `equilibrium`.

Written from the paper's equations 3 to 19, for one element at one twist: the root of the total force (eqs 15, 16)
with its exact Jacobian (eq. 17) and, where the root finder fails, descent on the stored energy. It shares the
constants of the contacts with `equilibrium`, but no other code, and is some thousand times slower.

Erratum: eq. 18, the Jacobian of N2, is wrong in its dimensions and undefined for d_t < 0. Used here is the
derivative of eq. 11, (I - N2 N2^T)/|d|.

The equilibrium need not be unique. Where crank and gear are nearly parallel (near beta = 0) the element may be
squeezed against either wall of its bore, and both positions are stable: solvers can be compared only if they start on
the same side. Without `start`, that is the wall towards which the element is pushed from its neutral position.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, root

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array

Vector = tuple[float, float]

TOLERANCE = 1e-9
"""Greatest residual force of an equilibrium, relative to its greatest contact force."""
_MICRO = 1e-6
"""The root finder and the minimiser work in micrometres, so that their variables are of order one."""


@dataclass(frozen=True)
class ElementEquilibrium:
    """Equilibrium of one element at one crank twist.

    gear, crank, cage_plus, cage_minus: contact forces C1 to C4, N; output_torque: eq. 19, N.m; crank_torque:
    moment of the crank's force about the drive's axis, N.m; radial, tangential: x_stat, m; method: "clearance"
    (found by geometry: gear and crank do not touch it), "root", "descent" or "none" (not found, no forces).
    """

    gear: float
    crank: float
    cage_plus: float
    cage_minus: float
    output_torque: float
    crank_torque: float
    radial: float
    tangential: float
    method: str


@dataclass(frozen=True)
class _Element:
    """Constants of one element, named as in the paper, at a crank twist phi; plain floats, for speed."""

    n1: Vector  # eq. 7
    k: tuple[float, float, float, float]
    exponent: float
    path: float  # c(beta)
    centre: Vector  # of the eccentric, the first term of eq. 9
    gear_gap: float  # q - r_RE
    radius_sum: float  # r_RE + r_Crank
    cage_gap: float  # r_Cage - r_RE
    load: Vector  # external force

    def forces(self, x: Vector) -> tuple[tuple[float, ...], tuple[Vector, ...], float, tuple[float, ...]]:
        """F_N (eq. 3) and normals of C1 to C4, |d|, and the indentations, zero without contact."""
        d_r, d_t = self.path - self.centre[0] + x[0], -self.centre[1] + x[1]  # eq. 9
        distance = math.hypot(d_r, d_t)
        normals = (self.n1, (d_r / distance, d_t / distance), (0.0, -1.0), (0.0, 1.0))  # eqs 7, 11, 12
        deltas = (
            -self.gear_gap - self.n1[0] * x[0] - self.n1[1] * x[1],  # eq. 8
            self.radius_sum - distance,  # eq. 10
            x[1] - self.cage_gap,  # eq. 13
            -x[1] - self.cage_gap,  # eq. 14
        )
        touching = tuple(max(delta, 0.0) for delta in deltas)
        normal_forces = tuple(k * delta**self.exponent for k, delta in zip(self.k, touching, strict=True))
        return normal_forces, normals, distance, touching

    def total_force(self, x: Vector) -> Vector:
        """Eq. 15 with the external force."""
        f, n, _, _ = self.forces(x)
        return (
            sum(f[j] * n[j][0] for j in range(4)) + self.load[0],
            sum(f[j] * n[j][1] for j in range(4)) + self.load[1],
        )

    def jacobian(self, x: Vector) -> Array:
        """Eq. 17 with eq. 18 corrected, (2, 2) N/m."""
        f, n, distance, delta = self.forces(x)
        stiffness = [self.exponent * k * d ** (self.exponent - 1) for k, d in zip(self.k, delta, strict=True)]
        geometric = f[1] / distance
        rr = -sum(s * v[0] * v[0] for s, v in zip(stiffness, n, strict=True)) + geometric * (1 - n[1][0] ** 2)
        rt = -sum(s * v[0] * v[1] for s, v in zip(stiffness, n, strict=True)) - geometric * n[1][0] * n[1][1]
        tt = -sum(s * v[1] * v[1] for s, v in zip(stiffness, n, strict=True)) + geometric * (1 - n[1][1] ** 2)
        return np.array([[rr, rt], [rt, tt]])

    def energy(self, x: Vector) -> float:
        """The stored energy, J, whose negative gradient is the total force."""
        p = self.exponent
        stored = sum(k * d ** (p + 1) / (p + 1) for k, d in zip(self.k, self.forces(x)[3], strict=True))
        return stored - self.load[0] * x[0] - self.load[1] * x[1]

    def radial_bounds(self, x_t: float) -> tuple[float, float]:
        """x_r at which an element displaced tangentially by x_t touches the crank, and the gear."""
        at_crank = math.sqrt(self.radius_sum**2 - (x_t - self.centre[1]) ** 2) - self.path + self.centre[0]
        return at_crank, (-self.gear_gap - self.n1[1] * x_t) / self.n1[0]


def solve_element(
    contacts: Contacts,
    index: int,
    crank_twist: float,
    external_force: Vector = (0.0, 0.0),
    start: Vector | None = None,
    descend: bool = False,
) -> ElementEquilibrium:
    """Equilibrium of the element `index` of `contacts` at one crank twist, rad.

    external_force: radial and tangential force on the element, N (the "additional forces" of eq. 15). start: first
    displacement, m. descend: by descent on the energy alone, without the root finder.
    """
    element = _element(contacts, index, crank_twist, external_force)
    side = _wall_side(element)
    if external_force == (0.0, 0.0):
        x_t = side * max(element.cage_gap, 0.0)
        at_crank, at_gear = element.radial_bounds(x_t)
        if at_crank <= at_gear:
            # The gap between crank and gear is convex in x_t, so that it is widest at a wall.
            return _result(element, ((at_crank + at_gear) / 2, x_t if element.cage_gap >= 0 else 0.0), "clearance")
    x = start if start is not None else _start_at_wall(element, side)
    found = None if descend else _root(element, x)
    if found is not None:
        return _result(element, found, "root")
    found = _descent(element, x)
    return _result(element, x if found is None else found, "none" if found is None else "descent")


def _element(c: Contacts, index: int, phi: float, external_force: Vector) -> _Element:
    k = tuple(float(values[index]) for values in (c.stiffness_gear, c.stiffness_crank, c.stiffness_cage))
    angle = float(c.beta[index]) + phi
    return _Element(
        n1=(-float(c.normal_r[index]), -float(c.normal_t[index])),
        k=(k[0], k[1], k[2], k[2]),
        exponent=c.exponent,
        path=float(c.path_radius[index]),
        centre=(c.eccentricity * math.cos(angle), c.eccentricity * math.sin(angle)),
        gear_gap=float(c.gear_gap[index]),
        radius_sum=float(c.radius_sum[index]),
        cage_gap=float(c.cage_gap[index]),
        load=(float(external_force[0]), float(external_force[1])),
    )


def _wall_side(element: _Element) -> float:
    """+1 or -1: the wall towards which crank and gear push the element in its neutral position."""
    n2 = element.forces((0.0, 0.0))[1][1]
    # The sign of the tangential resultant of a force at the crank and one at the gear that cancel radially.
    return math.copysign(1.0, n2[1] * -element.n1[0] + n2[0] * element.n1[1])


def _start_at_wall(element: _Element, side: float) -> Vector:
    """A start at one wall, midway between crank and gear, where the Jacobian is not singular."""
    x_t = side * max(element.cage_gap, 0.0)
    at_crank, at_gear = element.radial_bounds(x_t)
    return (at_crank + at_gear) / 2, x_t


def _root(element: _Element, x: Vector) -> Vector | None:
    """The root of eq. 15 by MINPACK's hybrid method, or None if it failed or the equilibrium is unstable."""
    answer = root(
        lambda y: element.total_force((y[0] * _MICRO, y[1] * _MICRO)),
        (x[0] / _MICRO, x[1] / _MICRO),
        jac=lambda y: element.jacobian((y[0] * _MICRO, y[1] * _MICRO)) * _MICRO,
        method="hybr",
        options={"xtol": 1e-14},
    )
    found = float(answer.x[0]) * _MICRO, float(answer.x[1]) * _MICRO
    return found if _is_stable(element, found) else None


def _descent(element: _Element, x: Vector) -> Vector | None:
    """The minimum of the stored energy, refined by a last search for the root; None if both failed."""

    def energy(y: Array) -> float:
        return element.energy((y[0] * _MICRO, y[1] * _MICRO)) / _MICRO

    def gradient(y: Array) -> Array:
        return -np.array(element.total_force((y[0] * _MICRO, y[1] * _MICRO)))

    def hessian(y: Array) -> Array:
        return -element.jacobian((y[0] * _MICRO, y[1] * _MICRO)) * _MICRO

    options = {"gtol": 1e-9, "maxiter": 2000, "initial_trust_radius": 1.0, "max_trust_radius": 100.0}
    try:
        answer = minimize(
            energy, np.array(x) / _MICRO, jac=gradient, hess=hessian, method="trust-exact", options=options
        )
    except ValueError:  # raised by SciPy for a constant that is NaN
        return None
    lowest = float(answer.x[0]) * _MICRO, float(answer.x[1]) * _MICRO
    found = _root(element, lowest)
    if found is not None:
        return found
    return lowest if _is_stable(element, lowest) else None


def _is_stable(element: _Element, x: Vector) -> bool:
    """Whether the forces at x cancel and the equilibrium is stable."""
    if not (math.isfinite(x[0]) and math.isfinite(x[1])):
        return False
    size = max(*element.forces(x)[0], math.hypot(*element.load))
    j = element.jacobian(x)
    # The force cannot become smaller than the rounding of the position makes it.
    rounding = 4 * np.finfo(float).eps * element.radius_sum * (abs(j[0, 0]) + abs(j[1, 1]))
    stable = j[0, 0] + j[1, 1] < 0 and j[0, 0] * j[1, 1] - j[0, 1] ** 2 > 0
    return bool(stable and math.hypot(*element.total_force(x)) <= TOLERANCE * size + rounding)


def _result(element: _Element, x: Vector, method: str) -> ElementEquilibrium:
    f, normals, _, _ = element.forces(x)
    if method == "none":
        f = (0.0, 0.0, 0.0, 0.0)
    n2, (centre_r, centre_t) = normals[1], element.centre
    return ElementEquilibrium(
        gear=f[0],
        crank=f[1],
        cage_plus=f[2],
        cage_minus=f[3],
        output_torque=(element.path + x[0]) * (f[2] - f[3]),  # eq. 19
        crank_torque=f[1] * (centre_r * n2[1] - centre_t * n2[0]),
        radial=x[0],
        tangential=x[1],
        method=method,
    )
