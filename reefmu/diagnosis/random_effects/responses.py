"""Response of one element's torque to deviations, over clearance, twist and position.

Between a rigid gear and a rigid cage the elements are independent: the torque of a drive is the sum over its elements,
and its scatter the sum of their responses. Deviations of balls, cranks and lobes act through one variable, the
clearance between gear and crank. Over its normal distribution a response is expanded in Hermite polynomials, whose
mean, linear, quadratic and cubic terms are uncorrelated; in the presets the linear one holds more than 96 % of the
variance.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.drawing.drive import Drive
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.numerics.arrays import Array

from .drawing_key import DrawingKey

N_TWISTS, N_POSITIONS = 49, 49
"""Nodes of the tables along twist and position. Chosen by judgement for a table of some tenths of a second."""
TWIST_MARGIN = 1.4
"""Greatest twist of the tables over the drawing's max_twist; beyond, they are held. Chosen by judgement."""
CLEARANCE_STEP = 0.6
"""Step between clearances of the tables, in standard deviations. Chosen by judgement for linear interpolation."""
MAX_DEVIATION = 4.8
"""Deviation, in standard deviations, to which single elements are solved beyond the clearances: eight steps. Chosen by
judgement; 1.6 in a million deviations exceed it."""
MAX_CLEARANCES = 61
"""Greatest number of clearances of the tables. Chosen by judgement to bound their size."""
_CLEARANCE_PER_RADIUS = {"element": -2.0, "crank": -1.0, "gear": 1.0}
"""Change of the clearance between gear and crank by the radius of a part: geometry, at small pressure angles."""
RESPONSES = ("mean", "linear", "quadratic", "cubic", "bore", "slope", "bend")
"""Names of the tables: Hermite terms in the clearance, the response to the bore of the cage, and the first and second
derivative of the mean by the twist."""


@dataclass(frozen=True)
class ElementResponses:
    """Tables of one element's torque on uniform axes.

    twist: (N_TWISTS,) rad; position: (N_POSITIONS,) rad, to the usable limit; clearance: (c,) m; deviation: m, standard
    deviation of a single element's clearance; single: (s, N_TWISTS, N_POSITIONS) N.m, torque at the clearances `solved`
    (s,); tables: (c, N_TWISTS, N_POSITIONS) N.m for each of `RESPONSES`, the mean and what one standard deviation
    does, the derivatives in N.m/rad and N.m/rad^2; shares: of element, crank and gear in the variance of the clearance.
    """

    twist: Array
    position: Array
    clearance: Array
    solved: Array
    deviation: float
    single: Array
    tables: dict[str, Array]
    shares: dict[str, float]

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


def element_responses(drive: Drive) -> ElementResponses:
    """Tables of one element of a drawing over its tolerances; solved in some tenths of a second, then cached."""
    return _solved(DrawingKey(drive))


@functools.lru_cache(maxsize=4)
def _solved(key: DrawingKey[Drive]) -> ElementResponses:
    # Compliant bodies couple the elements; the response of a single element is that between rigid bodies.
    rigid = replace(key.drive.beyond, bearing_stiffness=math.inf, housing_stiffness=math.inf)
    drive = replace(key.drive, beyond=rigid)
    twist = np.linspace(-TWIST_MARGIN, TWIST_MARGIN, N_TWISTS) * drive.max_twist
    position = np.linspace(-1, 1, N_POSITIONS) * drive.usable_limit
    max_clearance = 0.5 * drive.eccentricity * abs(drive.ratio) * drive.max_twist
    sigma = {part: abs(c) * drive.tolerances[part].sigma for part, c in _CLEARANCE_PER_RADIUS.items()}
    deviation = float(np.sqrt(sum(s**2 for s in sigma.values()))) or 1e-3 * max_clearance
    step = max(CLEARANCE_STEP * deviation, 2 * max_clearance / (MAX_CLEARANCES - 1))
    n_inner = int(np.ceil(max_clearance / step))
    n_outer = int(np.ceil(MAX_DEVIATION * deviation / step))
    solved = np.asarray(step * np.arange(-n_inner - n_outer, n_inner + n_outer + 1), float)
    single = np.stack([_torque(drive, twist, position, shift) for shift in solved])
    clearance = solved[n_outer : len(solved) - n_outer]
    z = step * np.arange(-n_outer, n_outer + 1) / deviation
    weight = np.exp(-(z**2) / 2)
    weight /= weight.sum()
    hermite = {
        "mean": np.ones_like(z),
        "linear": z,
        "quadratic": (z**2 - 1) / np.sqrt(2),
        "cubic": (z**3 - 3 * z) / np.sqrt(6),
    }
    tables = {
        name: np.stack([np.tensordot(weight * h, single[k : k + len(z)], 1) for k in range(len(clearance))])
        for name, h in hermite.items()
    }
    bore = drive.tolerances["cage"].sigma
    tables["bore"] = np.stack(
        [
            (_torque(drive, twist, position, shift, bore) - _torque(drive, twist, position, shift, -bore)) / 2
            for shift in clearance
        ]
    )
    tables["slope"] = np.gradient(tables["mean"], twist, axis=1)
    tables["bend"] = np.gradient(tables["slope"], twist, axis=1)
    shares = {part: (s / deviation) ** 2 for part, s in sigma.items()}
    return ElementResponses(twist, position, clearance, solved, deviation, single, tables, shares)


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
