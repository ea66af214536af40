"""Equilibrium of elements by Newton's method on the stored energy, for the cases without a closed form.

The force field of eq. 15 is conservative; the element rests where its energy

    E(x) = sum_j K_j d_j^(p+1)/(p+1) - P.x

is least. Vectorised over the elements; each keeps its own step length.

Erratum: the paper's eq. 18 (Jacobian of N2) is wrong in its dimensions and undefined for d_t < 0. Used here:
(I - N2 N2^T)/|d|.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .beyond.laws import Law, laws
from .contacts import Contacts

Array = NDArray[np.float64]

MOST_STEPS = 200
TOLERANCE = 1e-11
"""Residual force at which an element counts as in equilibrium, as a share of its contact forces; on top comes
the force that the rounding of its position makes."""


def iterate(contacts: Contacts, crank_twist: Array, load: Array, start: Array, shift: Array | None = None
            ) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Equilibrium of n elements, each at its own crank twist (n,) rad, under further forces `load`, (2, n) N.

    start: (2, n) m; shift: (2, n) m, displacement of the eccentric's centre. Returns the displacement (2, n) m,
    the contact forces (4, n) N, the crank's normal (2, n) and whether each element converged (n,).
    """
    field = _ForceField(contacts, crank_twist, load, shift)
    x = np.where(np.isfinite(start), start, 0.0)
    reach, rounding = 0.01 * contacts.reach, 4 * np.finfo(float).eps * contacts.reach
    damping = np.zeros(len(contacts))
    energy, local = field.energy(x), field.local(x)
    settled = np.zeros(len(contacts), bool)
    for _ in range(MOST_STEPS):
        force, scale, hessian = local[:2], local[2], local[3:]
        residual, uncertain = np.hypot(*force), rounding * (hessian[0] + hessian[2])
        settled |= residual <= TOLERANCE * scale + uncertain
        if settled.all():
            break
        step = _newton_step(force, hessian, damping, field.stiffness_unit)
        length = np.hypot(*step)
        step *= np.minimum(1.0, reach / np.maximum(length, 1e-300))
        step[:, settled] = 0.0
        tried = x + step
        tried_energy, tried_local = field.energy(tried), field.local(tried)
        # Below its rounding, and below what the rounding of the position makes of it, the energy no longer
        # tells: there the residual decides.
        level = np.abs(tried_energy - energy) <= 1e-11 * np.abs(energy) + rounding * scale
        better = np.where(level, np.hypot(*tried_local[:2]) < residual, tried_energy < energy)
        stuck = ~better & ~settled & (np.hypot(*step) <= 1e-16 * contacts.reach)
        settled |= stuck & (residual <= 1e-9 * scale)
        x, local = np.where(better, tried, x), np.where(better, tried_local, local)
        energy = np.where(better, tried_energy, energy)
        damping = np.where(better, damping / 8, np.maximum(8 * damping, 1e-6))
        damping[damping < 1e-9] = 0.0
    converged = np.hypot(*local[:2]) <= 1e-9 * local[2] + rounding * (local[3] + local[5])
    forces, normal_2 = field.forces(x)
    return x, forces, normal_2, converged


def _newton_step(force: Array, hessian: Array, damping: Array, unit: Array) -> Array:
    """Solve the damped 2 x 2 systems; where the Hessian is not positive, add enough to make it so."""
    rr, rt, tt = hessian
    mean, spread = (rr + tt) / 2, np.hypot((rr - tt) / 2, rt)
    lowest = mean - spread
    add = damping * (mean + spread + unit) + np.maximum(0.0, 1e-6 * (mean + spread + unit) - lowest)
    rr, tt = rr + add, tt + add
    det = rr * tt - rt * rt
    return np.stack([(tt * force[0] - rt * force[1]) / det, (rr * force[1] - rt * force[0]) / det])


def crank_tangent(contacts: Contacts, crank_twist: Array, x: Array, shift: Array) -> tuple[Array, Array]:
    """How the crank's force on elements in equilibrium at x and their torque follow the eccentric's centre.

    Returns the derivative of the force on the crank's side, rows rr, rt, tt (3, n) N/m, symmetric for the force has a
    potential, and that of the output torque (2, n) N. Nought where an element carries nothing.
    """
    field = _ForceField(contacts, crank_twist, np.zeros_like(x), shift)
    rr, rt, tt = field.local(x)[3:]
    c_rr, c_rt, c_tt = field.crank_stiffness(x)
    det = rr * tt - rt * rt
    held = det > 1e-12 * (rr + tt) ** 2
    scale = np.where(held, 1 / np.where(held, det, 1.0), 0.0)
    # Displacement per shift of the centre, H^-1 C, by columns.
    r_r, r_t = scale * (tt * c_rr - rt * c_rt), scale * (tt * c_rt - rt * c_tt)
    t_r, t_t = scale * (rr * c_rt - rt * c_rr), scale * (rr * c_tt - rt * c_rt)
    force = np.where(held, np.stack([c_rr - c_rr * r_r - c_rt * t_r, c_rt - c_rr * r_t - c_rt * t_t,
                                     c_tt - c_rt * r_t - c_tt * t_t]), 0.0)
    cage, stiffness = field.cage(x)
    lever = contacts.path_radius + x[0]
    torque = np.stack([lever * stiffness * t_r + cage * r_r, lever * stiffness * t_t + cage * r_t])
    return force, torque


class _ForceField:
    """Forces, energy and Hessian of eq. 15 for n elements, each at its crank twist."""

    def __init__(self, contacts: Contacts, crank_twist: Array, load: Array, shift: Array | None = None) -> None:
        c = contacts
        self._c, self._load = c, load
        # Hertz's power laws stand together in one array; others come one contact at a time.
        self._laws: tuple[Law, ...] | None = laws(c)
        self._foot = c.beta
        angle = c.beta + crank_twist
        self._d0 = np.stack([c.path_radius - c.eccentricity * np.cos(angle), -c.eccentricity * np.sin(angle)])
        if shift is not None:
            self._d0 -= shift
        self._stiffness = np.stack([c.stiffness_gear, c.stiffness_crank, c.stiffness_cage, c.stiffness_cage])
        # Stiffness at an indentation of a ten-thousandth of the size: damping's scale where nothing touches.
        self.stiffness_unit = c.stiffness_gear * (1e-4 * c.reach) ** (c.exponent - 1) * 1e-3

    def _gear(self, x: Array) -> tuple[Array, Array, Array, Array | float]:
        """The gear's outward normal r, t, its gap along it (eq. 8), and how the normal turns, 1/m."""
        c = self._c
        if c.profile is None:
            return c.normal_r, c.normal_t, c.gear_gap, 0.0
        foot = c.profile.nearest(c.beta, x, self._foot, steps=3)
        self._foot = foot.beta
        distance = foot.normal_r * x[0] + foot.normal_t * x[1] - foot.offset
        return foot.normal_r, foot.normal_t, c.gear_gap + foot.offset, foot.curvature / (1 + foot.curvature * distance)

    def _indentations(self, x: Array) -> tuple[Array, Array, Array]:
        c = self._c
        d = self._d0 + x
        distance = np.hypot(*d)
        normal_r, normal_t, gap, _ = self._gear(x)
        delta = np.stack([
            normal_r * x[0] + normal_t * x[1] - gap,  # eq. 8
            c.reach - distance,  # eq. 10
            x[1] - c.cage_gap,  # eq. 13
            -x[1] - c.cage_gap,  # eq. 14
        ])
        return np.maximum(delta, 0.0), d / distance, distance

    def energy(self, x: Array) -> Array:
        p = self._c.exponent
        delta, _, _ = self._indentations(x)
        if self._laws is None:
            stored = (self._stiffness * delta ** (p + 1)).sum(axis=0) / (p + 1)
        else:
            stored = sum((law.force(d)[2] for law, d in zip(self._laws, delta, strict=True)), start=np.zeros(1))
        return stored - (self._load * x).sum(axis=0)

    def forces(self, x: Array) -> tuple[Array, Array]:
        delta, normal_2, _ = self._indentations(x)
        return self._carried(delta)[0], normal_2

    def crank_stiffness(self, x: Array) -> tuple[Array, Array, Array]:
        """Derivative of the crank's force by the centre's place with the element held, rr, rt, tt, N/m."""
        delta, n2, distance = self._indentations(x)
        f, k = self._carried(delta)
        bend = f[1] / distance
        return (k[1] * n2[0] ** 2 - bend * (1 - n2[0] ** 2), k[1] * n2[0] * n2[1] + bend * n2[0] * n2[1],
                k[1] * n2[1] ** 2 - bend * (1 - n2[1] ** 2))

    def cage(self, x: Array) -> tuple[Array, Array]:
        """Tangential force on the cage, N, and stiffness of both walls, N/m."""
        f, k = self._carried(self._indentations(x)[0])
        return f[2] - f[3], k[2] + k[3]

    def _carried(self, delta: Array) -> tuple[Array, Array]:
        """Forces, N, and stiffnesses, N/m, of the four contacts, (4, n)."""
        p = self._c.exponent
        if self._laws is None:
            return self._stiffness * delta**p, p * self._stiffness * delta ** (p - 1)
        found = [law.force(d)[:2] for law, d in zip(self._laws, delta, strict=True)]
        return np.stack([f for f, _ in found]), np.stack([k for _, k in found])

    def local(self, x: Array) -> Array:
        """Rows (6, n): total force r, t; size of the forces in it; Hessian rr, rt, tt of the energy."""
        delta, n2, distance = self._indentations(x)
        n_r, n_t, _, curvature = self._gear(x)
        f, k = self._carried(delta)
        total_r = -n_r * f[0] + n2[0] * f[1] + self._load[0]
        total_t = -n_t * f[0] + n2[1] * f[1] - f[2] + f[3] + self._load[1]
        bend = f[1] / distance
        rr = k[0] * n_r**2 + k[1] * n2[0] ** 2 - bend * (1 - n2[0] ** 2)
        rt = k[0] * n_r * n_t + k[1] * n2[0] * n2[1] + bend * n2[0] * n2[1]
        tt = k[0] * n_t**2 + k[1] * n2[1] ** 2 + k[2] + k[3] - bend * (1 - n2[1] ** 2)
        if self._c.profile is not None:
            # The exact profile's normal turns as the element moves along it.
            hold = f[0] * curvature
            rr, rt, tt = rr + hold * n_t**2, rt - hold * n_r * n_t, tt + hold * n_r**2
        size = f.max(axis=0) + np.hypot(*self._load) + 1e-12
        return np.stack([total_r, total_t, size, rr, rt, tt])
