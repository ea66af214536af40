"""Response of one element's torque to deviations, over clearance, twist and position.

Between a rigid gear and a rigid cage the elements are independent: the torque of a drive is the sum over its elements,
and its scatter the sum of their responses. Deviations of balls, cranks and lobes act through one variable, the
clearance between gear and crank; those of the places of bores and lobes along their circle through another, by which
the element is twisted and stands elsewhere on the profile. Over the normal distribution of both a response is expanded
in Hermite polynomials, whose terms are uncorrelated (Wiener, The Homogeneous Chaos, 1938). Where deviations are as
large as indentations, elements lift off, and terms of the second and third order are far above the noise.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import shift
from scipy.sparse import csr_array
from scipy.special import eval_hermitenorm

from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.drawing.drive import Drive
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.drawing.twist_limits import CLEARANCE_PER_RADIUS, clearance_deviation, clearance_reach
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.io.drawing_key import DrawingKey
from stiffness_model.numerics.arrays import Array

N_TWISTS, N_POSITIONS = 49, 49
"""Nodes of the tables along twist and position. Chosen by judgement for a table of some tenths of a second."""
TWIST_MARGIN = 1.4
"""Greatest twist of the tables over the drawing's max_twist; beyond, they are held. Chosen by judgement."""
CLEARANCE_STEP = 0.6
"""Step between clearances of the tables, in standard deviations by sizes. Chosen by judgement for linear
interpolation."""
MAX_DEVIATION = 4.8
"""Deviation, in standard deviations, to which single elements are solved beyond the clearances. Chosen by judgement;
1.6 in a million deviations exceed it."""
MAX_CLEARANCES = 61
"""Greatest number of clearances of the tables. Chosen by judgement to bound their size."""
PLACES = 1.2
"""Deviation of the places of bores and of lobes along their circle over that of their own sizes, which drawings state
alone. Chosen by the likelihood of records of individuals, of which `tests/benchmarks/scatter/bench_places.py` shows
some; a covariance that lacks places takes them for kinematic errors."""
OUTWARDS = 0.4
"""Deviation of the places of lobes outwards over that along their circle, less because the tolerance of the profile
bounds how far out a lobe is. Chosen by the same likelihood."""
MAX_ORDER = 5
"""Greatest order of the terms in both variables together. Chosen by the likelihood of individuals: averaged over
positions of the first element, the third order brings up to 250 in -2 log likelihood and further ones less than 30; at
a position that is known the fifth brings up to 70, and seven change it by less than 6."""
TERMS = tuple((p, n - p) for n in range(1, MAX_ORDER + 1) for p in range(n, -1, -1))
"""Orders of the terms in the clearance and along the circle."""
_GAUSS = np.asarray(np.polynomial.hermite_e.hermegauss(MAX_ORDER + 1), float)
NODES, NODE_WEIGHTS = _GAUSS[0], _GAUSS[1] / _GAUSS[1].sum()


@dataclass(frozen=True)
class PlaceDeviations:
    """Standard deviations of places: bore, lobe: m, along the circle on which they are; outwards: m, of lobes; radius:
    m, of the circle."""

    bore: float
    lobe: float
    outwards: float
    radius: float

    @property
    def along(self) -> float:
        """rad, of the angle by which bore and lobe are apart."""
        return math.hypot(self.bore, self.lobe) / self.radius


def place_deviations(drive: Drive, places: float = PLACES, outwards: float = OUTWARDS) -> PlaceDeviations:
    """Deviations of the places of a drive's bores and lobes that are so many times as wide along their circle as those
    of their sizes, and outwards by another factor as wide as that."""
    bore, lobe = (places * drive.tolerances[part].sigma for part in ("cage", "gear"))
    return PlaceDeviations(bore, lobe, outwards * lobe, drive.crank_radius + drive.element_radius)


@dataclass(frozen=True)
class ElementResponses:
    """Tables of one element's torque on uniform axes.

    twist: (N_TWISTS,) rad; position: (N_POSITIONS,) rad, to the usable limit; clearance: (c,) m; deviation: m, standard
    deviation of a single element's clearance, by sizes and places; single: (s, N_TWISTS, N_POSITIONS) N.m, torque at
    the clearances `solved` (s,); tables: (c, N_TWISTS, N_POSITIONS) N.m by name: `term` of every order, where the
    zeroth is the mean over all deviations; "mean", over those of sizes alone; "bore", what one standard deviation of
    the cage's bore does; and "slope", N.m/rad, derivative of the zeroth by the twist; shares: of element, crank, gear
    and the place of the lobe in the variance of the clearance, and of the place of the bore in that along the circle;
    places: deviations of places.
    """

    twist: Array
    position: Array
    clearance: Array
    solved: Array
    deviation: float
    single: Array
    tables: dict[str, Array]
    shares: dict[str, float]
    places: PlaceDeviations

    def at_clearances(self, clearance: Array) -> dict[str, Array]:
        """Tables (c, N_TWISTS, N_POSITIONS), N.m, at clearances (c,), m, held at the ends, by name."""
        k, f = locate_cells(self.clearance, clearance)
        f = f[:, None, None]
        return {name: (1 - f) * table[k] + f * table[k + 1] for name, table in self.tables.items()}

    def interpolate(
        self, tables: Array, number: NDArray[np.intp], twist: Array, position: Array, weight: Array
    ) -> Array:
        """Values (r, k) of c tables (c, N_TWISTS, N_POSITIONS, r) at k points, linear between nodes, times a weight.

        number: (k,), of the table of each point; twist, position: (k,) rad, held at the ends; weight: (k,).
        """
        row, f = locate_cells(self.twist, twist)
        column, g = locate_cells(self.position, position)
        nodes, size = len(self.position), len(self.twist) * len(self.position)
        # Both arrays in the types and the order of a sparse matrix, which then copies neither.
        corner, share = np.empty((len(twist), 4), np.int32), np.empty((len(twist), 4))
        corner[:, 0] = number * size + row * nodes + column
        for k, step in enumerate((1, nodes, nodes + 1), 1):
            np.add(corner[:, 0], step, out=corner[:, k])
        above = weight * f
        below = weight - above
        np.multiply(below, g, out=share[:, 1])
        np.subtract(below, share[:, 1], out=share[:, 0])
        np.multiply(above, g, out=share[:, 3])
        np.subtract(above, share[:, 3], out=share[:, 2])
        ends = np.arange(0, share.size + 1, 4, dtype=np.int32)
        matrix = csr_array((share.ravel(), corner.ravel(), ends), shape=(len(twist), len(tables) * size))
        return np.ascontiguousarray((matrix @ tables.reshape(-1, tables.shape[-1])).T)


def hermite(order: int, x: Array) -> Array:
    """Hermite polynomial of standard normal deviations x, of any shape, with variance 1.

    >>> hermite(2, np.array([0.0, 1.0])).round(4).tolist()
    [-0.7071, 0.0]
    """
    return np.asarray(eval_hermitenorm(order, x), float) / math.sqrt(math.factorial(order))


def term(outwards: int, along: int) -> str:
    """Name of the table of the term of these orders in the clearance and along the circle."""
    return f"{outwards}, {along}"


def element_responses(drive: Drive) -> ElementResponses:
    """Tables of one element of a drawing over its tolerances; solved in some tenths of a second, then cached."""
    return _solved(DrawingKey(drive))


@functools.lru_cache(maxsize=4)
def _solved(key: DrawingKey[Drive]) -> ElementResponses:
    return solved_responses(key.drive, place_deviations(key.drive))


def solved_responses(drive: Drive, places: PlaceDeviations) -> ElementResponses:
    """Tables of one element of a drawing over its tolerances and given deviations of places."""
    # Compliant bodies couple the elements; the response of a single element is that between rigid bodies.
    rigid = replace(drive.beyond, bearing_stiffness=math.inf, housing_stiffness=math.inf)
    drive = replace(drive, beyond=rigid)
    twist = np.linspace(-TWIST_MARGIN, TWIST_MARGIN, N_TWISTS) * drive.max_twist
    position = np.linspace(-1, 1, N_POSITIONS) * drive.usable_limit
    max_clearance = clearance_reach(drive)
    sigma = {part: abs(c) * drive.tolerances[part].sigma for part, c in CLEARANCE_PER_RADIUS.items()}
    of_sizes = clearance_deviation(drive) or 1e-3 * max_clearance
    sigma["place"] = places.outwards
    deviation = float(np.hypot(of_sizes, sigma["place"]))
    step = max(CLEARANCE_STEP * of_sizes, 2 * max_clearance / (MAX_CLEARANCES - 1))
    n_inner = int(np.ceil(max_clearance / step))
    n_outer = int(np.ceil(MAX_DEVIATION * deviation / step))
    solved = np.asarray(step * np.arange(-n_inner - n_outer, n_inner + n_outer + 1), float)
    single = np.stack([_torque(drive, twist, position, c) for c in solved])
    clearance = solved[n_outer : len(solved) - n_outer]
    z = np.asarray(step * np.arange(-n_outer, n_outer + 1) / deviation, float)

    def over_clearances(factor: Array, width: float = 1.0) -> Array:
        weight = np.exp(-((z / width) ** 2) / 2)
        weight = factor * weight / weight.sum()
        return np.stack([np.tensordot(weight, single[k : k + len(z)], 1) for k in range(len(clearance))])

    tables = {"mean": over_clearances(np.ones_like(z), of_sizes / deviation)}
    # An element ahead of its place has less twist and stands farther on the profile, both in steps of the tables.
    less_twist = _moves(N_TWISTS, -NODES * places.along / (twist[1] - twist[0]))
    farther = _moves(N_POSITIONS, NODES * places.along * (drive.ratio - 1) / (position[1] - position[0]))
    for p in range(MAX_ORDER + 1):
        outwards = over_clearances(hermite(p, z))
        moved = less_twist[:, None] @ outwards @ farther[:, None].mT
        for q in range(MAX_ORDER + 1 - p):
            tables[term(p, q)] = np.asarray(np.tensordot(NODE_WEIGHTS * hermite(q, NODES), moved, 1), float)
    bore = drive.tolerances["cage"].sigma
    tables["bore"] = np.stack(
        [(_torque(drive, twist, position, c, bore) - _torque(drive, twist, position, c, -bore)) / 2 for c in clearance]
    )
    tables["slope"] = np.gradient(tables[term(0, 0)], twist, axis=1)
    shares = {part: (s / deviation) ** 2 for part, s in sigma.items()}
    shares["bore"] = (places.bore / max(places.along * places.radius, 1e-300)) ** 2
    return ElementResponses(twist, position, clearance, solved, deviation, single, tables, shares, places)


def _moves(nodes: int, steps: Array) -> Array:
    """(m, nodes, nodes), what moves values at so many nodes by steps (m,) of theirs, by cubic splines, held at the
    ends."""
    return np.stack([shift(np.eye(nodes), (-by, 0.0), mode="nearest") for by in steps])


def _torque(drive: Drive, twist: Array, position: Array, clearance: float, bore: float = 0.0) -> Array:
    """(N_TWISTS, N_POSITIONS) N.m, torque of one element with all parts at their mean radii.

    clearance: m, beyond the drawn one; bore: m, added to the radius of the cage's bore.
    """

    def radius(part: str, nominal: float, deviation: float = 0.0) -> Array:
        return np.full(position.shape, nominal + drive.tolerances[part].offset + deviation)

    r = drive.element_radius
    contacts = build_contacts(
        drive,
        Deviations(
            position,
            radius("element", r),
            radius("crank", drive.crank_radius),
            radius("cage", r, bore),
            radius("gear", r),
        ),
        clearance,
    )
    return solve(contacts, twist * drive.ratio).output_torque


def locate_cells(nodes: Array, values: Array) -> tuple[NDArray[np.intp], Array]:
    """Cells of a uniform axis `nodes` that hold the values, and the positions within, 0 to 1; held at the ends."""
    place = np.clip((values - nodes[0]) / (nodes[1] - nodes[0]), 0.0, len(nodes) - 1)
    cell = np.minimum(place.astype(np.intp), len(nodes) - 2)
    return cell, place - cell
