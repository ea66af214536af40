"""The paper's own way to the equilibrium of one element: the check on `equilibrium`.

Written from the paper's equations 3 to 19, one element and one twist at a time: the root of the total force
(eqs 15, 16) with its exact Jacobian (eq. 17) and, where the root finder fails, descent on the stored energy.
It shares the contacts' constants with `equilibrium`, and no other code; it is some thousand times slower.

Erratum: eq. 18, the Jacobian of N2, is wrong in its dimensions and undefined for d_t < 0. Used here is the
derivative of eq. 11, (I - N2 N2^T)/|d|.

The equilibrium need not be the only one. Where crank and gear are nearly parallel (near beta = 0) the element
may be squeezed against either wall of its bore, and both positions are stable; whoever compares two solvers
has to start them on the same side. `start` sets the side here; left out, it is the wall to which the element
is pushed from its neutral position.
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
"""Greatest remaining force of an equilibrium, as a share of its greatest contact force."""
_MICRO = 1e-6  # The solvers see micrometres: numbers near one.


@dataclass(frozen=True)
class ElementEquilibrium:
    """Equilibrium of one element at one crank twist.

    gear, crank, cage_plus, cage_minus: contact forces C1 to C4, N; output_torque: eq. 19, N.m; crank_torque:
    moment of the crank's force about the drive's axis, N.m; radial, tangential: x_stat, m; method: "play"
    (found by geometry: it touches nothing but a wall), "root", "descent" or "none" (not found, no forces).
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
    """One element's constants, named as in the paper, with its crank at the twist phi; floats, for speed."""

    n1: Vector  # eq. 7
    k: tuple[float, float, float, float]
    exponent: float
    path: float  # c(beta)
    centre: Vector  # of the eccentric, the first term of eq. 9
    gear_gap: float  # q - r_RE
    radius_sum: float  # r_RE + r_Crank
    cage_gap: float  # r_Cage - r_RE
    extra: Vector

    def forces(self, x: Vector) -> tuple[tuple[float, ...], tuple[Vector, ...], float, tuple[float, ...]]:
        """F_N (eq. 3) and normals of C1 ... C4, |d| and the indentations, zero without contact."""
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
        """Eq. 15, with the additional forces."""
        f, n, _, _ = self.forces(x)
        return (
            sum(f[j] * n[j][0] for j in range(4)) + self.extra[0],
            sum(f[j] * n[j][1] for j in range(4)) + self.extra[1],
        )

    def jacobian(self, x: Vector) -> Array:
        """Eq. 17 with eq. 18 corrected, (2, 2) N/m."""
        f, n, distance, delta = self.forces(x)
        stiffness = [self.exponent * k * d ** (self.exponent - 1) for k, d in zip(self.k, delta, strict=True)]
        bend = f[1] / distance
        rr = -sum(s * v[0] * v[0] for s, v in zip(stiffness, n, strict=True)) + bend * (1 - n[1][0] ** 2)
        rt = -sum(s * v[0] * v[1] for s, v in zip(stiffness, n, strict=True)) - bend * n[1][0] * n[1][1]
        tt = -sum(s * v[1] * v[1] for s, v in zip(stiffness, n, strict=True)) + bend * (1 - n[1][1] ** 2)
        return np.array([[rr, rt], [rt, tt]])

    def energy(self, x: Vector) -> float:
        """The stored energy, J, whose negative gradient is the total force."""
        p = self.exponent
        stored = sum(k * d ** (p + 1) / (p + 1) for k, d in zip(self.k, self.forces(x)[3], strict=True))
        return stored - self.extra[0] * x[0] - self.extra[1] * x[1]

    def window(self, x_t: float) -> tuple[float, float]:
        """x_r at which the element touches the crank, and the gear, when it stands at x_t."""
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

    external_force: radial and tangential force on the element, N (the "additional forces" of eq. 15).
    start: displacement, m, from which to search. descend: by energy descent alone, without the root finder.
    """
    element = _element(contacts, index, crank_twist, external_force)
    side = _pushed_to(element)
    if external_force == (0.0, 0.0):
        x_t = side * max(element.cage_gap, 0.0)
        at_crank, at_gear = element.window(x_t)
        if at_crank <= at_gear:
            # The narrowing of the gap between crank and gear is convex in x_t: it is widest at a wall.
            return _result(element, ((at_crank + at_gear) / 2, x_t if element.cage_gap >= 0 else 0.0), "play")
    x = start if start is not None else _overlapping(element, side)
    found = None if descend else _root(element, x)
    if found is not None:
        return _result(element, found, "root")
    found = _descent(element, x)
    return _result(element, x if found is None else found, "none" if found is None else "descent")


def _element(c: Contacts, index: int, phi: float, external_force: Vector) -> _Element:
    one = {
        name: float(getattr(c, name)[index])
        for name in (
            "beta",
            "path_radius",
            "normal_r",
            "normal_t",
            "gear_gap",
            "radius_sum",
            "cage_gap",
            "stiffness_gear",
            "stiffness_crank",
            "stiffness_cage",
        )
    }
    angle = one["beta"] + phi
    return _Element(
        n1=(-one["normal_r"], -one["normal_t"]),
        k=(one["stiffness_gear"], one["stiffness_crank"], one["stiffness_cage"], one["stiffness_cage"]),
        exponent=c.exponent,
        path=one["path_radius"],
        centre=(c.eccentricity * math.cos(angle), c.eccentricity * math.sin(angle)),
        gear_gap=one["gear_gap"],
        radius_sum=one["radius_sum"],
        cage_gap=one["cage_gap"],
        extra=(float(external_force[0]), float(external_force[1])),
    )


def _pushed_to(element: _Element) -> float:
    """+1 or -1: the wall to which crank and gear push the element when they squeeze it in its neutral place."""
    n2 = element.forces((0.0, 0.0))[1][1]
    # Two forces that cancel radially; their tangential rest has the sign of this.
    return math.copysign(1.0, n2[1] * -element.n1[0] + n2[0] * element.n1[1])


def _overlapping(element: _Element, side: float) -> Vector:
    """A start at one wall, midway between crank and gear: without contact the Jacobian would be singular."""
    x_t = side * max(element.cage_gap, 0.0)
    at_crank, at_gear = element.window(x_t)
    return (at_crank + at_gear) / 2, x_t


def _root(element: _Element, x: Vector) -> Vector | None:
    """The root of eq. 15 by MINPACK's hybrid method, or None if it failed or found a place that is unstable."""
    answer = root(
        lambda y: element.total_force((y[0] * _MICRO, y[1] * _MICRO)),
        (x[0] / _MICRO, x[1] / _MICRO),
        jac=lambda y: element.jacobian((y[0] * _MICRO, y[1] * _MICRO)) * _MICRO,
        method="hybr",
        options={"xtol": 1e-14},
    )
    found = float(answer.x[0]) * _MICRO, float(answer.x[1]) * _MICRO
    return found if _rests(element, found) else None


def _descent(element: _Element, x: Vector) -> Vector | None:
    """Descent to the least stored energy, made exact by a last search for the root; None if both failed."""

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
    except ValueError:  # SciPy's answer to a constant that is not a number
        return None
    lowest = float(answer.x[0]) * _MICRO, float(answer.x[1]) * _MICRO
    found = _root(element, lowest)
    if found is not None:
        return found
    return lowest if _rests(element, lowest) else None


def _rests(element: _Element, x: Vector) -> bool:
    """Whether the forces at x cancel, and come back after a small push."""
    if not (math.isfinite(x[0]) and math.isfinite(x[1])):
        return False
    size = max(*element.forces(x)[0], math.hypot(*element.extra))
    j = element.jacobian(x)
    # What the rounding of a position within the drive leaves of the force cannot be asked for.
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
