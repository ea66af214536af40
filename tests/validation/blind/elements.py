"""The torque of single rolling elements, solved by stiffness_model, and of drives as sums over them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import ndtri
from scipy.stats import qmc

from stiffness_model import Drive
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.numerics.arrays import Array

CHUNK = 6000
"""Elements times twists that are solved at once; chosen so that their arrays fit the cache of a core."""
EDGE = 0.01
"""Half the width, rad, over which an element enters or leaves the usable profile."""


def element_torques(drive: Drive, deviations: Deviations, twist: Array, clearance: float) -> Array:
    """Output torque, N.m, of every element at every twist (rad), (n_elements, n_twist).

    clearance: m, added to that of the gear. Balls larger than their bore are solved separately, because a single one
    would require the slow iteration for its whole chunk.
    """
    contacts = build_contacts(drive, deviations, clearance)
    out = np.empty((len(contacts), len(twist)))
    tight = contacts.cage_gap < 0
    step = max(1, CHUNK // len(twist))
    for group, size in ((np.flatnonzero(~tight), step), (np.flatnonzero(tight), 50 * step)):
        for first in range(0, len(group), size):
            part = group[first : first + size]
            out[part] = solve(contacts[part], twist * drive.ratio).output_torque.T
    return out


def spread_elements(drive: Drive, count: int, beta: float | None = None) -> Deviations:
    """`count` elements that represent the population: a Sobol sample of positions on the usable profile and of normal
    deviations; all at the position `beta`, rad, if given.
    """
    low = 1 if beta is not None else 0
    points = qmc.Sobol(5, scramble=False).random(count)[:, low:] + 0.5 / count
    normal = ndtri(points[:, 1 - low :])
    place = (2 * points[:, 0] - 1) * drive.usable_limit if beta is None else np.full(count, beta)
    return Deviations(place, *_radii(drive, normal.T))


def mean_torque(drive: Drive, twist: Array, clearance: float, count: int = 8192) -> tuple[Array, Array]:
    """Mean over the population of the torque and of the sum of the elements' absolute torques, N.m, over twist."""
    torque = element_torques(drive, spread_elements(drive, count), twist, clearance)
    carrying = drive.elements * drive.usable_limit / np.pi
    return carrying * torque.mean(axis=0), carrying * np.abs(torque).mean(axis=0)


def _shifted(twist: Array, torque: Array, shift: Array) -> Array:
    """Torques (k, n), N.m, over equidistant twists (n,), rad, at twists that are greater by a shift (k,), rad, of each;
    by cubic splines, linear beyond the ends."""
    step = twist[1] - twist[0]
    spline = CubicSpline(twist, torque, axis=1).c
    whole = np.floor(shift / step).astype(int)
    cell = np.arange(len(twist)) + whole[:, None]
    inside = np.clip(cell, 0, len(twist) - 2)
    place = (shift - whole * step)[:, None] + (cell - inside) * step
    x = np.clip(place, 0, step)
    cubic, square, slope, value = (part[inside, np.arange(len(shift))[:, None]] for part in spline)
    return ((cubic * x + square) * x + slope) * x + value + (place - x) * ((3 * cubic * x + 2 * square) * x + slope)


def _radii(drive: Drive, normal: Array) -> tuple[Array, ...]:
    """Radii of element, crank, cage and gear, m, from standard normal numbers (4, ...)."""
    nominal = (drive.element_radius, drive.crank_radius, drive.element_radius, drive.element_radius)
    windows = [drive.tolerances[part] for part in ("element", "crank", "cage", "gear")]
    return tuple(r + t.offset + t.sigma * z for r, t, z in zip(nominal, windows, normal, strict=True))


@dataclass(frozen=True)
class Individual:
    """One drive with its own parts, m: radii of ball, crank and bore move with the element, (n,), distances of the
    lobes stay in the gear, (eccentrics, lobes). start: positions of the elements on the profile at crank angle 0, rad,
    unwrapped. bore_place, lobe_place: (n,) and (eccentrics, lobes) rad, by which a bore or a lobe lies beside its place
    on the circle of the elements, in the sense of a twist.
    """

    start: Array
    element: Array
    crank: Array
    cage: Array
    lobe: Array
    bore_place: Array
    lobe_place: Array


def draw_individual(drive: Drive, rng: np.random.Generator, places: float = 0.0) -> Individual:
    """Draw one drive within the drawing's tolerances.

    places: deviation of the places of bores and lobes, over that of the lobes' sizes; a drawing does not state it.
    """
    n, rows = drive.elements, drive.eccentrics
    own = rng.standard_normal((4, n))
    if drive.crank_deviation == "eccentric":
        own[1] = own[1][np.arange(n) % rows]
    element, crank, cage, _ = _radii(drive, own)
    tolerance = drive.tolerances["gear"]
    lobe = drive.element_radius + tolerance.offset + tolerance.sigma * rng.standard_normal((rows, drive.lobes))
    # Unwrapped, because the number of turns determines the lobe that an element meets.
    start = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(n) / n - np.pi
    deviation = places * tolerance.sigma
    outwards = deviation * rng.standard_normal(lobe.shape)
    along = deviation / (drive.crank_radius + drive.element_radius)
    bore_place, lobe_place = along * rng.standard_normal(n), along * rng.standard_normal(lobe.shape)
    return Individual(start, element, crank, cage, lobe + outwards, bore_place, lobe_place)


def individual_torque(
    drive: Drive, one: Individual, turn: Array, twist: Array, clearance: float, missing: int | None = None
) -> Array:
    """Torque, N.m, (n_turn, n_twist), of an individual whose crank has turned by `turn`, rad, relative to the cage.

    Every element keeps its ball, crank and bore while its position moves by `turn`; with every turn it meets the next
    lobe. missing: index of an element that is absent.
    """
    n, rows = drive.elements, drive.eccentrics
    way = one.start + turn[:, None]
    periods = np.floor((way + np.pi) / (2 * np.pi)).astype(int)
    number = np.broadcast_to(np.arange(n), way.shape)
    # The cage of a reversing drive turns against the crank, so that an element meets the next lobe, not the previous
    # one.
    met = number % rows, (number // rows - drive.orientation * periods) % drive.lobes
    # An element beside its place is where the output would have to turn back to, at a crank that stands.
    twisted = one.bore_place[number] + one.lobe_place[met]
    beta = (way + np.pi) % (2 * np.pi) - np.pi - (drive.ratio - 1) * twisted
    # An element enters and leaves over some distance, between the nodes of `turn`, where a step would be smeared.
    share = np.clip((drive.usable_limit - np.abs(beta)) / (2 * EDGE) + 0.5, 0.0, 1.0)
    usable = share > 0
    if missing is not None:
        usable &= number != missing
    which, lobe = number[usable], one.lobe[met][usable]
    deviations = Deviations(beta[usable], one.element[which], one.crank[which], one.cage[which], lobe)
    torque = element_torques(drive, deviations, twist, clearance)
    if twisted.any():
        torque = _shifted(twist, torque, twisted[usable])
    first = np.concatenate([[0], np.cumsum(usable.sum(axis=1))[:-1]])
    return np.add.reduceat(torque * share[usable][:, None], first, axis=0)


assert [f.name for f in fields(Deviations)] == ["beta", "element", "crank", "cage", "gear"]
