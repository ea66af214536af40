"""Equilibrium of elements by Newton's method on the stored energy, for the cases without a closed form.

The force field of eq. 15 is conservative; the element rests where its energy

    E(x) = sum_j K_j d_j^(p+1)/(p+1) - P.x

is least. Vectorised over the elements; each keeps its own step length and leaves when it rests.

Erratum: the paper's eq. 18 (Jacobian of N2) is wrong in its dimensions and undefined for d_t < 0. Used here:
(I - N2 N2^T)/|d|.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..contact.laws import ContactLaw, contact_laws
from ..numerics.arrays import Array

MOST_STEPS = 200
TOLERANCE = 1e-11
"""Residual force at which an element counts as in equilibrium, as a share of its contact forces; on top comes
the force that the rounding of its position makes."""
BLOCK = 16384
"""Elements, each at its twist, that callers hand over at once: the iteration takes about 1 kB for each."""


def iterate(
    contacts: Contacts, crank_twist: Array, load: Array, start: Array, shift: Array | None = None
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Equilibrium of n elements, each at its own crank twist (n,) rad, under further forces `load`, (2, n) N.

    start: (2, n) m; shift: (2, n) m, displacement of the eccentric's centre. Returns the displacement (2, n) m,
    the contact forces (4, n) N, the crank's normal (2, n) and whether each element converged (n,).

    An element leaves the iteration once it rests or no step helps it: slow ones cost only their own time.
    """
    field, todo = _ForceField.of(contacts, crank_twist, load, shift), np.arange(len(contacts))
    at = field.at(np.where(np.isfinite(start), start, 0.0), contacts.beta)
    damping, stuck = np.zeros(len(contacts)), np.zeros(len(contacts), bool)
    left = []
    for _ in range(MOST_STEPS):
        uncertain = field.rounding * (at.hessian[0] + at.hessian[2])
        rests = stuck | (np.hypot(*at.total) <= TOLERANCE * at.size + uncertain)
        if rests.any():
            left.append((todo[rests], at[rests], uncertain[rests]))
            going = np.flatnonzero(~rests)
            todo, at, field, damping = todo[going], at[going], field[going], damping[going]
        if not len(todo):
            break
        residual = np.hypot(*at.total)
        step = _newton_step(at.total, at.hessian, damping, field.stiffness_unit)
        step *= np.minimum(1.0, field.most_step / np.maximum(np.hypot(*step), 1e-300))
        tried = field.at(at.x + step, at.foot)
        # Below its rounding, and below what the rounding of the position makes of it, the energy no longer
        # tells: there the residual decides.
        level = np.abs(tried.energy - at.energy) <= 1e-11 * np.abs(at.energy) + field.rounding * at.size
        better = np.where(level, np.hypot(*tried.total) < residual, tried.energy < at.energy)
        at = at.replaced(better, tried)
        # A step below the rounding of the position that does not help is the last: no damping would help more.
        stuck = ~better & ~(np.hypot(*step) > 0.1 * field.rounding)
        damping = np.where(better, damping / 8, np.maximum(8 * damping, 1e-6))
        damping[damping < 1e-9] = 0.0
    left.append((todo, at, field.rounding * (at.hessian[0] + at.hessian[2])))
    back = np.argsort(np.concatenate([index for index, _, _ in left]))

    def joined(name: str) -> Array:
        return np.concatenate([getattr(place, name) for _, place, _ in left], axis=-1)[..., back]

    uncertain = np.concatenate([off for _, _, off in left])[back]
    converged = np.hypot(*joined("total")) <= 1e-9 * joined("size") + uncertain
    return joined("x"), joined("force"), joined("normal_2"), converged


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
    at = _ForceField.of(contacts, crank_twist, np.zeros_like(x), shift).at(x, contacts.beta)
    rr, rt, tt = at.hessian
    c_rr, c_rt, c_tt = at.crank_stiffness()
    det = rr * tt - rt * rt
    held = det > 1e-12 * (rr + tt) ** 2
    scale = np.where(held, 1 / np.where(held, det, 1.0), 0.0)
    # Displacement per shift of the centre, H^-1 C, by columns.
    r_r, r_t = scale * (tt * c_rr - rt * c_rt), scale * (tt * c_rt - rt * c_tt)
    t_r, t_t = scale * (rr * c_rt - rt * c_rr), scale * (rr * c_tt - rt * c_rt)
    force = np.where(
        held,
        np.stack([c_rr - c_rr * r_r - c_rt * t_r, c_rt - c_rr * r_t - c_rt * t_t, c_tt - c_rt * r_t - c_tt * t_t]),
        0.0,
    )
    cage, stiffness = at.force[2] - at.force[3], at.stiffness[2] + at.stiffness[3]
    lever = contacts.path_radius + x[0]
    torque = np.stack([lever * stiffness * t_r + cage * r_r, lever * stiffness * t_t + cage * r_t])
    return force, torque


@dataclass(frozen=True)
class _Place:
    """n elements at a place: what they feel there.

    x: (2, n) m; foot: (n,) rad, nearest point of an exact profile; energy: (n,) J; total: (2, n) N, all forces on
    the element; size: (n,) N, of the forces in it; hessian: (3, n) N/m, rr, rt, tt of the energy; force, stiffness:
    (4, n) N, N/m, of the contacts; normal_2: (2, n) of the crank; bend: (n,) N/m, its force over the distance.
    """

    x: Array
    foot: Array
    energy: Array
    total: Array
    size: Array
    hessian: Array
    force: Array
    stiffness: Array
    normal_2: Array
    bend: Array

    def __getitem__(self, index: NDArray[np.bool_] | NDArray[np.intp]) -> _Place:
        return _Place(*(getattr(self, f.name)[..., index] for f in fields(self)))

    def replaced(self, where: NDArray[np.bool_], other: _Place) -> _Place:
        """The other place for some elements."""
        return _Place(*(np.where(where, getattr(other, f.name), getattr(self, f.name)) for f in fields(self)))

    def crank_stiffness(self) -> tuple[Array, Array, Array]:
        """Derivative of the crank's force by the centre's place with the element held, rr, rt, tt, N/m."""
        k, (n_r, n_t), bend = self.stiffness[1], self.normal_2, self.bend
        return (k * n_r**2 - bend * (1 - n_r**2), (k + bend) * n_r * n_t, k * n_t**2 - bend * (1 - n_t**2))


@dataclass(frozen=True)
class _ForceField:
    """Forces, energy and Hessian of eq. 15 for n elements, each at its crank twist.

    from_centre: (2, n) m, from the eccentric's centre to the element's neutral position; load: (2, n) N; power: (4, n)
    N/m^p, the contacts' stiffnesses where all are Hertz's power laws, which stand together in one array; laws: of the
    contacts where not.
    """

    contacts: Contacts
    load: Array
    from_centre: Array
    power: Array
    laws: tuple[ContactLaw, ...] | None

    @staticmethod
    def of(contacts: Contacts, crank_twist: Array, load: Array, shift: Array | None = None) -> _ForceField:
        """shift: (2, n) m, displacement of the eccentric's centre."""
        c, angle = contacts, contacts.beta + crank_twist
        away = np.stack([c.path_radius - c.eccentricity * np.cos(angle), -c.eccentricity * np.sin(angle)])
        if shift is not None:
            away -= shift
        power = np.stack([c.stiffness_gear, c.stiffness_crank, c.stiffness_cage, c.stiffness_cage])
        return _ForceField(c, load, away, power, contact_laws(c))

    def __getitem__(self, index: NDArray[np.intp]) -> _ForceField:
        some = self.contacts[index]
        return _ForceField(
            some, self.load[:, index], self.from_centre[:, index], self.power[:, index], contact_laws(some)
        )

    @property
    def stiffness_unit(self) -> Array:
        """Stiffness at an indentation of a ten-thousandth of the size: damping's scale where nothing touches."""
        c = self.contacts
        return c.stiffness_gear * (1e-4 * c.radius_sum) ** (c.exponent - 1) * 1e-3

    @property
    def most_step(self) -> Array:
        """m."""
        return 0.01 * self.contacts.radius_sum

    @property
    def rounding(self) -> Array:
        """Of an element's position, m."""
        return 4 * np.finfo(float).eps * self.contacts.radius_sum

    def at(self, x: Array, foot: Array) -> _Place:
        """What the elements feel displaced by x, (2, n) m; foot: (n,) rad, a guess at an exact profile's."""
        c, p = self.contacts, self.contacts.exponent
        n_r, n_t, gap, curvature = c.normal_r, c.normal_t, c.gear_gap, None
        if c.profile is not None:
            near = c.profile.nearest_point(c.beta, x, foot, steps=3)
            foot, n_r, n_t, gap = near.beta, near.normal_r, near.normal_t, c.gear_gap + near.offset
            curvature = near.curvature / (1 + near.curvature * (n_r * x[0] + n_t * x[1] - near.offset))
        d = self.from_centre + x
        distance = np.hypot(*d)
        n2 = d / distance
        # Indentations: eqs 8, 10, 13 and 14.
        delta = np.stack(
            [n_r * x[0] + n_t * x[1] - gap, c.radius_sum - distance, x[1] - c.cage_gap, -x[1] - c.cage_gap]
        )
        np.maximum(delta, 0.0, out=delta)
        if self.laws is None:
            k = self.power * (np.sqrt(delta) if p == 1.5 else delta ** (p - 1))
            f = k * delta
            k *= p
            energy = (f * delta).sum(axis=0) / (p + 1)
        else:
            forces, slopes, energies = zip(
                *(law.force(own) for law, own in zip(self.laws, delta, strict=True)), strict=True
            )
            f, k, energy = np.stack(forces), np.stack(slopes), np.sum(energies, axis=0)
        energy = energy - (self.load * x).sum(axis=0)
        total = np.stack([n2[0] * f[1] - n_r * f[0], n2[1] * f[1] - n_t * f[0] - f[2] + f[3]]) + self.load
        bend = f[1] / distance
        hessian = np.stack(
            [
                k[0] * n_r**2 + k[1] * n2[0] ** 2 - bend * (1 - n2[0] ** 2),
                k[0] * n_r * n_t + k[1] * n2[0] * n2[1] + bend * n2[0] * n2[1],
                k[0] * n_t**2 + k[1] * n2[1] ** 2 + k[2] + k[3] - bend * (1 - n2[1] ** 2),
            ]
        )
        if curvature is not None:
            # The exact profile's normal turns as the element moves along it.
            hold = f[0] * curvature
            hessian += np.stack([hold * n_t**2, -hold * n_r * n_t, hold * n_r**2])
        size = f.max(axis=0) + np.hypot(*self.load) + 1e-12
        return _Place(x, foot, energy, total, size, hessian, f, k, n2, bend)
