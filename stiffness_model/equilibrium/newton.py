"""Equilibrium of elements without a closed form, by Newton's method on the stored energy.

The force field of eq. 15 is conservative; an element is in stable equilibrium where its energy

    E(x) = sum_j K_j d_j^(p+1)/(p+1) - P.x

has a minimum. Vectorised over the elements; each has its own step length and leaves the iteration when it converges.

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

MAX_STEPS = 200
TOLERANCE = 1e-11
"""Residual force of an element in equilibrium, relative to its contact forces; the force that follows from the rounding
of its position comes on top."""
MAX_ELEMENTS = 16384
"""Elements, each at its twist, that callers hand over at once: the iteration takes about 1 kB for each."""


def minimise_energy(
    contacts: Contacts, crank_twist: Array, load: Array, start: Array, centre_displacement: Array | None = None
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Equilibrium of n elements, each at its own crank twist (n,) rad, under external forces `load`, (2, n) N.

    start: (2, n) m, first displacements; centre_displacement: (2, n) m, of the eccentric's centre. Returns the
    displacement (2, n) m, the contact forces (4, n) N, the crank's normal (2, n) and whether each element converged
    (n,).

    An element leaves the iteration when it converges or no step improves it: slow elements cost only their own time.
    """
    field = _ForceField.of(contacts, crank_twist, load, centre_displacement)
    active = np.arange(len(contacts))
    state = field.at(np.where(np.isfinite(start), start, 0.0), contacts.beta)
    damping, stalled = np.zeros(len(contacts)), np.zeros(len(contacts), bool)
    finished: list[tuple[NDArray[np.intp], _State, Array]] = []
    for _ in range(MAX_STEPS):
        uncertainty = field.rounding * (state.hessian[0] + state.hessian[2])
        done = stalled | (np.hypot(*state.total) <= TOLERANCE * state.force_scale + uncertainty)
        if done.any():
            finished.append((active[done], state[done], uncertainty[done]))
            remaining = np.flatnonzero(~done)
            active, state, field, damping = active[remaining], state[remaining], field[remaining], damping[remaining]
        if not len(active):
            break
        residual = np.hypot(*state.total)
        step = _damped_step(state.total, state.hessian, damping, field.typical_stiffness)
        step *= np.minimum(1.0, field.max_step / np.maximum(np.hypot(*step), 1e-300))
        candidate = field.at(state.x + step, state.foot)
        # Where the energies differ by less than their rounding, and by less than what the rounding of the position
        # does to them, the residual decides.
        tied = np.abs(candidate.energy - state.energy) <= 1e-11 * np.abs(state.energy) + (
            field.rounding * state.force_scale
        )
        better = np.where(tied, np.hypot(*candidate.total) < residual, candidate.energy < state.energy)
        state = state.replaced(better, candidate)
        # A step below the rounding of the position that improves nothing is the last: damping would not help.
        stalled = ~better & ~(np.hypot(*step) > 0.1 * field.rounding)
        damping = np.where(better, damping / 8, np.maximum(8 * damping, 1e-6))
        damping[damping < 1e-9] = 0.0
    finished.append((active, state, field.rounding * (state.hessian[0] + state.hessian[2])))
    back = np.argsort(np.concatenate([index for index, _, _ in finished]))

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part, name) for _, part, _ in finished], axis=-1)[..., back]

    uncertainty = np.concatenate([force for _, _, force in finished])[back]
    converged = np.hypot(*joined("total")) <= 1e-9 * joined("force_scale") + uncertainty
    return joined("x"), joined("force"), joined("normal_2"), converged


def _damped_step(force: Array, hessian: Array, damping: Array, typical_stiffness: Array) -> Array:
    """Solve the damped 2 x 2 systems; a Hessian that is not positive definite is made so."""
    rr, rt, tt = hessian
    mean, spread = (rr + tt) / 2, np.hypot((rr - tt) / 2, rt)
    lowest = mean - spread
    scale = mean + spread + typical_stiffness
    add = damping * scale + np.maximum(0.0, 1e-6 * scale - lowest)
    rr, tt = rr + add, tt + add
    det = rr * tt - rt * rt
    return np.stack([(tt * force[0] - rt * force[1]) / det, (rr * force[1] - rt * force[0]) / det])


def crank_tangent(contacts: Contacts, crank_twist: Array, x: Array, centre_displacement: Array) -> tuple[Array, Array]:
    """Derivatives of crank force and output torque of elements in equilibrium at x by the eccentric's centre.

    Returns the derivative of the force on the crank, components rr, rt, tt (3, n) N/m, symmetric because the force
    has a potential, and that of the output torque (2, n) N. Zero where an element carries nothing.
    """
    state = _ForceField.of(contacts, crank_twist, np.zeros_like(x), centre_displacement).at(x, contacts.beta)
    rr, rt, tt = state.hessian
    c_rr, c_rt, c_tt = state.crank_stiffness()
    det = rr * tt - rt * rt
    held = det > 1e-12 * (rr + tt) ** 2
    scale = np.where(held, 1 / np.where(held, det, 1.0), 0.0)
    # Derivative of the displacement by the centre, H^-1 C, by columns.
    r_r, r_t = scale * (tt * c_rr - rt * c_rt), scale * (tt * c_rt - rt * c_tt)
    t_r, t_t = scale * (rr * c_rt - rt * c_rr), scale * (rr * c_tt - rt * c_rt)
    force = np.where(
        held,
        np.stack([c_rr - c_rr * r_r - c_rt * t_r, c_rt - c_rr * r_t - c_rt * t_t, c_tt - c_rt * r_t - c_tt * t_t]),
        0.0,
    )
    cage, stiffness = state.force[2] - state.force[3], state.stiffness[2] + state.stiffness[3]
    lever = contacts.path_radius + x[0]
    torque = np.stack([lever * stiffness * t_r + cage * r_r, lever * stiffness * t_t + cage * r_t])
    return force, torque


@dataclass(frozen=True, eq=False)
class _State:
    """Forces and derivatives of n elements at given displacements.

    x: (2, n) m; foot: (n,) rad, nearest point of an exact profile; energy: (n,) J; total: (2, n) N, sum of all forces
    on the element; force_scale: (n,) N, size of the forces in it; hessian: (3, n) N/m, rr, rt, tt of the energy;
    force, stiffness: (4, n) N, N/m, of the contacts; normal_2: (2, n) of the crank; geometric: (n,) N/m, the crank's
    geometric stiffness, its force over |d|.
    """

    x: Array
    foot: Array
    energy: Array
    total: Array
    force_scale: Array
    hessian: Array
    force: Array
    stiffness: Array
    normal_2: Array
    geometric: Array

    def __getitem__(self, index: NDArray[np.bool_] | NDArray[np.intp]) -> _State:
        return _State(*(getattr(self, f.name)[..., index] for f in fields(self)))

    def replaced(self, where: NDArray[np.bool_], other: _State) -> _State:
        """This state, with the elements of a mask (n,) in the other one."""
        return _State(*(np.where(where, getattr(other, f.name), getattr(self, f.name)) for f in fields(self)))

    def crank_stiffness(self) -> tuple[Array, Array, Array]:
        """Derivative of the crank's force by the centre's position with the element fixed, rr, rt, tt, N/m."""
        k, (n_r, n_t), g = self.stiffness[1], self.normal_2, self.geometric
        return (k * n_r**2 - g * (1 - n_r**2), (k + g) * n_r * n_t, k * n_t**2 - g * (1 - n_t**2))


@dataclass(frozen=True, eq=False)
class _ForceField:
    """Forces, energy and Hessian of eq. 15 for n elements, each at its crank twist.

    from_centre: (2, n) m, from the eccentric's centre to the element's neutral position; load: (2, n) N; power: (4, n)
    N/m^p, the contacts' stiffnesses in one array, for contacts that all follow Hertz's power law; laws: of the
    contacts otherwise.
    """

    contacts: Contacts
    load: Array
    from_centre: Array
    power: Array
    laws: tuple[ContactLaw, ...] | None

    @staticmethod
    def of(
        contacts: Contacts, crank_twist: Array, load: Array, centre_displacement: Array | None = None
    ) -> _ForceField:
        """The field of elements whose eccentric's centre is displaced by `centre_displacement`, (2, n) m."""
        c, angle = contacts, contacts.beta + crank_twist
        from_centre = np.stack([c.path_radius - c.eccentricity * np.cos(angle), -c.eccentricity * np.sin(angle)])
        if centre_displacement is not None:
            from_centre -= centre_displacement
        power = np.stack([c.stiffness_gear, c.stiffness_crank, c.stiffness_cage, c.stiffness_cage])
        return _ForceField(c, load, from_centre, power, contact_laws(c))

    def __getitem__(self, index: NDArray[np.intp]) -> _ForceField:
        some = self.contacts[index]
        laws = contact_laws(some)
        return _ForceField(some, self.load[:, index], self.from_centre[:, index], self.power[:, index], laws)

    @property
    def typical_stiffness(self) -> Array:
        """Scale of the damping where nothing touches, N/m: small against a contact's stiffness under load."""
        c = self.contacts
        return c.stiffness_gear * (1e-4 * c.radius_sum) ** (c.exponent - 1) * 1e-3

    @property
    def max_step(self) -> Array:
        """Greatest step, m; chosen by judgement, far above every displacement."""
        return 0.01 * self.contacts.radius_sum

    @property
    def rounding(self) -> Array:
        """Rounding error of an element's position, m."""
        return 4 * np.finfo(float).eps * self.contacts.radius_sum

    def at(self, x: Array, foot: Array) -> _State:
        """The elements displaced by x, (2, n) m; foot: (n,) rad, first guess of the nearest point of the profile."""
        c, p = self.contacts, self.contacts.exponent
        n_r, n_t, gap, curvature = c.normal_r, c.normal_t, c.gear_gap, None
        if c.profile is not None:
            point = c.profile.nearest_point(c.beta, x, foot, steps=3)
            foot, n_r, n_t, gap = point.beta, point.normal_r, point.normal_t, c.gear_gap + point.offset
            curvature = point.curvature / (1 + point.curvature * (n_r * x[0] + n_t * x[1] - point.offset))
        d = self.from_centre + x
        distance = np.hypot(*d)
        n2 = d / distance
        # Indentations: eqs 8, 10, 13 and 14.
        at_gear, at_crank = n_r * x[0] + n_t * x[1] - gap, c.radius_sum - distance
        delta = np.stack([at_gear, at_crank, x[1] - c.cage_gap, -x[1] - c.cage_gap])
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
        geometric = f[1] / distance
        hessian = np.stack(
            [
                k[0] * n_r**2 + k[1] * n2[0] ** 2 - geometric * (1 - n2[0] ** 2),
                k[0] * n_r * n_t + k[1] * n2[0] * n2[1] + geometric * n2[0] * n2[1],
                k[0] * n_t**2 + k[1] * n2[1] ** 2 + k[2] + k[3] - geometric * (1 - n2[1] ** 2),
            ]
        )
        if curvature is not None:
            # The exact profile's normal rotates as the element moves along the profile.
            along = f[0] * curvature
            hessian += np.stack([along * n_t**2, -along * n_r * n_t, along * n_r**2])
        force_scale = f.max(axis=0) + np.hypot(*self.load) + 1e-12
        return _State(x, foot, energy, total, force_scale, hessian, f, k, n2, geometric)
