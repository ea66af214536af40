"""The contacts of the simulated drives: the mean drive of a drawing, and individuals with errors of size and position.

An element whose bore is ahead in the cage by eps, facing a lobe ahead in the gear by eta, under an eccentric ahead by
zeta, is an element of a perfect drive seen from the rotated lobe: its place on the profile is
beta + (i - 1)(eps - eta), and its eccentric stands at beta + i twist + zeta - eps past it.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.special import ndtri
from scipy.stats import qmc

from stiffness_model import Drive
from stiffness_model.contact.element_contacts import Contacts, build_contacts
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.equilibrium.closed_form import closed_form
from stiffness_model.numerics.arrays import Array
from stiffness_model.rotation.element_positions import ElementPositions, Window, element_positions
from stiffness_model.rotation.individual_contacts import IndividualContacts
from stiffness_model.rotation.individual_drive import Individual, draw_individual, mean_individual

AT_ONCE = 24_000
"""Contacts that are solved at once, so that their arrays stay in the cache."""
REACH = 1.8
"""Greatest contact twist of the mean drive's table over the drawing's max_twist."""
WIDEST = 0.7
"""Greatest change of clearance in the table, over the clearance that max_twist closes."""
RIG_STIFFNESS = 0.4
"""Of the loading device, over full torque per full twist: it carries the twist through the drive's play."""


def solve_pairs(contacts: Contacts, lead: Array) -> Array:
    """Output torque, N.m, (n,), of contacts whose eccentrics lead by `lead`, rad. A ball larger than its bore counts
    as one that just fits."""
    moved = replace(contacts, beta=contacts.beta + lead)
    return closed_form(moved, np.zeros(1)).output_torque[0]


@dataclass(frozen=True)
class MeanDrive:
    """The mean over all drives of a drawing, with its torque as a spline over twist, rad, and clearance, m."""

    drive: Drive
    table: RectBivariateSpline
    full_torque: float

    @property
    def full_twist(self) -> float:
        """The drawing's max_twist, rad."""
        return self.drive.max_twist

    def torque(self, twist: Array, cage: Array, clearance: Array) -> Array:
        """Torque, N.m, (n,); the mean drive does not depend on the cage's angle."""
        return self.table.ev(twist, clearance)

    def slope(self, twist: Array, clearance: Array | float = 0.0) -> Array:
        """Stiffness of the contacts, N.m/rad."""
        return self.table.ev(twist, np.broadcast_to(clearance, np.shape(twist)), dx=1)

    def twist_under(self, load: Array, clearance: Array) -> Array:
        """Contact twist, rad, at which drive and rig rest under a load command (1: full load)."""
        spring = RIG_STIFFNESS * self.full_torque / self.full_twist
        wanted = load * (1 + RIG_STIFFNESS) * self.full_torque
        low = np.full(len(load), -REACH * self.full_twist)
        high = -low
        for _ in range(24):
            middle = (low + high) / 2
            below = self.table.ev(middle, clearance) + spring * middle < wanted
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return (low + high) / 2

    def missing_torque(self, twist: Array, cage: Array, clearance: Array, place: float) -> Array:
        """Mean torque, N.m, of the element that stands at `place`, rad, on the profile at cage angle 0."""
        drive = self.drive
        beta = np.mod(place + (drive.ratio - 1) * cage + np.pi, 2 * np.pi) - np.pi
        inside = np.flatnonzero(np.abs(beta) < drive.usable_limit)
        normal = ndtri(qmc.Sobol(4, scramble=False).random(32) + 0.5 / 32).T
        found, step = np.zeros(len(beta)), max(1, AT_ONCE // 32)
        for first in range(0, len(inside), step):
            some = inside[first : first + step]
            sizes = (np.tile(part, len(some)) for part in radii(drive, normal))
            contacts = build_contacts(drive, Deviations(np.repeat(beta[some], 32), *sizes))
            contacts = replace(contacts, gear_gap=contacts.gear_gap + np.repeat(clearance[some], 32))
            torque = solve_pairs(contacts, np.repeat(drive.ratio * twist[some], 32))
            found[some] = torque.reshape(-1, 32).mean(axis=1)
        return found


def radii(drive: Drive, normal: Array) -> tuple[Array, ...]:
    """Radii of element, crank, cage and gear, m, from standard normal deviates (4, ...)."""
    nominal = (drive.element_radius, drive.crank_radius, drive.element_radius, drive.element_radius)
    zones = [drive.tolerances[part] for part in ("element", "crank", "cage", "gear")]
    return tuple(r + zone.offset + zone.sigma * z for r, zone, z in zip(nominal, zones, normal, strict=True))


def mean_drive(drive: Drive, elements: int = 4096, twists: int = 65, clearances: int = 21) -> MeanDrive:
    """Tabulate the mean drive from elements that are spread evenly over places and deviations (Sobol)."""
    half = np.linspace(0, REACH * drive.max_twist, twists)
    widest = WIDEST * drive.eccentricity * abs(drive.ratio) * drive.max_twist
    shift = np.linspace(-widest, widest, clearances)
    table = np.stack([mean_curve(drive, half, float(clearance), elements) for clearance in shift], axis=1)
    # The mean drive answers to both directions alike.
    table = np.concatenate([-table[:0:-1], table - table[:1]])
    spline = RectBivariateSpline(np.concatenate([-half[:0:-1], half]), shift, table)
    return MeanDrive(drive, spline, float(spline.ev(drive.max_twist, 0.0)))


def mean_curve(drive: Drive, twist: Array, clearance: float = 0.0, elements: int = 4096) -> Array:
    """Torque, N.m, of the mean drive over twist, rad, at one clearance, m."""
    points = qmc.Sobol(5, scramble=False).random(elements) + 0.5 / elements
    beta = (2 * points[:, 0] - 1) * drive.usable_limit
    contacts = build_contacts(drive, Deviations(beta, *radii(drive, ndtri(points[:, 1:]).T)), clearance)
    carrying = drive.elements * drive.usable_limit / np.pi
    return carrying * np.array([solve_pairs(contacts, np.array(drive.ratio * t)).mean() for t in twist])


def varied(drive: Drive, eccentricity: float = 1.0, hard: float = 1.0, soft: float = 1.0) -> Drive:
    """A drawing whose eccentricity and moduli (hard: elements and crank; soft: gear and cage) are off by factors."""
    factor = {"element": hard, "crank": hard, "gear": soft, "cage": soft}
    parts = {p: replace(m, youngs_modulus=factor[p] * m.youngs_modulus) for p, m in drive.materials.items()}
    return replace(drive, eccentricity=eccentricity * drive.eccentricity, materials=parts)


@dataclass(frozen=True)
class Assembly:
    """An individual with errors of position, rad. bore: (n,) of every bore in the cage; lobe: (eccentrics, lobes) of
    every lobe in the gear; eccentric: (eccentrics,) of every eccentric on the crank. missing: number of the element
    that carries nothing, or None.
    """

    one: Individual
    bore: Array
    lobe: Array
    eccentric: Array
    missing: int | None = None

    @functools.cached_property
    def parts(self) -> IndividualContacts:
        """What stays with the elements while they turn."""
        return IndividualContacts(self.one)

    @functools.cached_property
    def window(self) -> Window:
        """The window of the drive, widened by what errors of bores and lobes move its elements by at most."""
        drive = self.one.drive
        margin = abs(drive.ratio - 1) * float(np.abs(self.bore).max() + np.abs(self.lobe).max())
        return self.parts.window.widened(margin, drive)

    def torque(self, twist: Array, cage: Array, clearance: Array) -> Array:
        """Torque, N.m, (n,), at contact twists and cage angles, rad, with clearances, m, added to the gear's."""
        found, step = np.empty(len(twist)), max(1, AT_ONCE // self.window.width)
        for first in range(0, len(twist), step):
            some = slice(first, first + step)
            at = element_positions(self.one, self.window, cage[some])
            found[some] = self.each(at, twist[some], clearance[some]).sum(axis=1)
        return found

    def each(self, at: ElementPositions, twist: Array, clearance: Array) -> Array:
        """Torques, N.m, (n, width), of elements that would stand `at` places without errors of bores and lobes."""
        one, parts, drive = self.one, self.parts, self.one.drive
        eps, eta = self.bore[at.element], self.lobe[at.row, at.lobe]
        shift = (drive.ratio - 1) * (eps - eta)
        beta = at.beta + shift
        weight = parts.window.weight(beta)
        if self.missing is not None:
            weight = weight * (at.element != self.missing)
        lead = drive.ratio * twist[:, None] + self.eccentric[at.element % drive.eccentrics] - eps - shift
        number, q = at.element.ravel(), (one.lobe[at.row, at.lobe] + clearance[:, None]).ravel()
        flat = beta.ravel()
        normal_r, normal_t = drive.path.normal(flat, drive.orientation)
        contacts = replace(
            parts.own_contacts[number],
            beta=flat,
            path_radius=drive.path.radius(flat),
            normal_r=normal_r,
            normal_t=normal_t,
            gear_gap=q - one.element[number],
            stiffness_gear=parts.gear_table.stiffness(flat, q),
        )
        return solve_pairs(contacts, lead.ravel()).reshape(beta.shape) * weight


def draw_assembly(drive: Drive, rng: np.random.Generator) -> Assembly:
    """A drive by the drawing's tolerances; positions are as good, along the circle, as sizes are along the radius."""
    one = draw_individual(drive, int(rng.integers(2**31)))
    radius = drive.path.centre_distance
    bore = drive.tolerances["cage"].sigma / radius * rng.standard_normal(drive.elements)
    lobe = drive.tolerances["gear"].sigma / radius * rng.standard_normal(one.lobe.shape)
    eccentric = drive.tolerances["crank"].sigma / drive.eccentricity * rng.standard_normal(drive.eccentrics)
    return Assembly(one, bore, lobe, eccentric - eccentric.mean())


def linear_columns(drive: Drive, start: float, twist: Array, cage: Array) -> Array:
    """What one standard deviation of every size and position does to the torque along contact twists and cage angles,
    rad, (n,), of a drive whose element 0 starts at `start`, rad: columns (n_deviations, n) N.m."""
    middle = mean_individual(drive, start)
    n, rows, radius = drive.elements, drive.eccentrics, drive.path.centre_distance
    sigma = {part: zone.sigma for part, zone in drive.tolerances.items()}
    eps, eta, zeta = sigma["cage"] / radius, sigma["gear"] / radius, sigma["crank"] / drive.eccentricity
    # All differences are of the same elements: those that the greatest error of position can bring into the window.
    window = IndividualContacts(middle).window.widened(abs(drive.ratio - 1) * max(eps, eta), drive)
    at = element_positions(middle, window, cage)
    element, lobe = at.element, at.row * drive.lobes + at.lobe
    row = element % rows
    none = Assembly(middle, np.zeros(n), np.zeros_like(middle.lobe), np.zeros(rows))
    clear = np.zeros(len(twist))
    # Differences over the spread of single clearances are those of the mean drive, in which contact sets in smoothly.
    wide = float(np.hypot(np.hypot(2 * sigma["element"], sigma["crank"]), sigma["gear"]))

    def difference(plus: Assembly, minus: Assembly) -> Array:
        return (plus.each(at, twist, clear) - minus.each(at, twist, clear)) / 2

    per_metre = (none.each(at, twist, clear + wide) - none.each(at, twist, clear - wide)) / (2 * wide)
    by_eccentric = drive.crank_deviation == "eccentric"
    own = np.hypot(2 * sigma["element"], 0.0 if by_eccentric else sigma["crank"])
    bores = [replace(none, one=replace(middle, cage=middle.cage + s * sigma["cage"])) for s in (1, -1)]
    parts = [
        (own * per_metre, element, n),
        (sigma["gear"] * per_metre, lobe, middle.lobe.size),
        (difference(*(replace(none, bore=s * eps * np.ones(n)) for s in (1, -1))), element, n),
        (difference(*bores), element, n),
        (
            difference(*(replace(none, lobe=s * eta * np.ones_like(middle.lobe)) for s in (1, -1))),
            lobe,
            middle.lobe.size,
        ),
        (difference(*(replace(none, eccentric=s * zeta * np.ones(rows)) for s in (1, -1))), row, rows),
    ]
    if by_eccentric:
        parts.append((sigma["crank"] * per_metre, row, rows))
    columns = []
    for values, group, count in parts:
        index = group + count * np.arange(len(twist))[:, None]
        columns.append(np.bincount(index.ravel(), values.ravel(), count * len(twist)).reshape(len(twist), count).T)
    return np.concatenate(columns)
