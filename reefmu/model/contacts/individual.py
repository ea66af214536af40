"""The contacts of an individual drive's own parts in CasADi, solved at every twist and angle.

The torque of an individual changes whenever an element passes a lobe, some thousand times in the turn of the output
after which it repeats; a table of that over the twist would take ten megabytes, and more with an axis for the
clearance. The parts are a few hundred numbers and their equilibrium is a closed form: the model holds the parts, and so
covers the whole period and every clearance without an interpolation error.

The equations are those of `stiffness_model.equilibrium.closed_form` for one element, as expressions; tests hold the
two together. The iteration for a ball larger than its bore (one in 800 as drawn) is left out: such a ball counts as
one that just fits.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.bspline import Axis, fit, weights
from stiffness_model.rotation.element_positions import element_lobe_pairs
from stiffness_model.rotation.individual_contacts import IndividualContacts
from stiffness_model.rotation.individual_drive import Individual

from .tables import locate

LEAN_ITERATIONS = 2
"""Fixed-point iterations for the direction of the crank's contact force. Two leave an error below 1e-6 of full torque,
5e-7 on the steel drives."""
MINIMUM_SHARE = 1e-12
"""Lower bound of forces, as a share of their size, because roots have no derivative at zero; far below rounding."""
N_ANGLES = 200
"""Angles over a turn of the output at which the greatest stiffness is sought; chosen by judgement."""
COLUMNS = 6
"""Columns of the table along the profile: path radius, normal_t/normal_r, 1/normal_r and the three of
`GearComplianceTable`, in radial direction."""


def individual_function(individual: Individual, lookup: Lookup) -> ca.Function:
    """(twist rad, clearance m, output angle rad) -> (torque, stiffness, max contact force, load share, in range).

    Extrapolated as `tables.lookup_function`: linearly in twist, with the clearance limited to its range.
    """
    twist, clearance, angle = ca.MX.sym("twist"), ca.MX.sym("clearance"), ca.MX.sym("angle")
    inside = ca.fmax(lookup.twist.start, ca.fmin(lookup.twist.stop, twist))
    held = ca.fmax(lookup.clearance.start, ca.fmin(lookup.clearance.stop, clearance))
    in_range = ca.logic_and(
        ca.logic_and(twist >= lookup.twist.start, twist <= lookup.twist.stop),
        ca.logic_and(clearance >= lookup.clearance.start, clearance <= lookup.clearance.stop),
    )
    parts = IndividualContacts(individual)
    axis, table = _profile(parts)
    beta, element, meeting = _element_positions(parts, angle)
    width = parts.window.width
    cell, f = locate(axis, ca.fabs(beta))
    rows = ca.vertcat(*(_gather(table, (cell + a) * COLUMNS + k) for a in range(4) for k in range(COLUMNS)))
    own = parts.own_contacts
    crank_root = own.stiffness_crank ** (1 / own.exponent)
    sizes = np.stack(
        [
            individual.element,
            own.radius_sum,
            np.maximum(own.cage_gap, 0.0),
            own.stiffness_crank,
            crank_root,
            crank_root * own.stiffness_cage ** (-1 / own.exponent),
        ]
    )
    sizes = ca.vertcat(*(_gather(row, element) for row in sizes))
    q = _gather(individual.lobe[element_lobe_pairs(individual.drive)], meeting)
    solved = _element(parts).map("elements", "serial", width, [5, 6], [])
    torque, slope, force = solved(rows, f, beta, sizes, q, inside, held)
    whole, stiffness = ca.sum2(torque), ca.sum2(slope)
    side = ca.if_else(whole < 0, -1, 1)
    none = MINIMUM_SHARE * lookup.full_torque  # without torque the share is 1, as where one element carries all
    share = ca.fmin(1, (ca.mmax(side * torque) + none) / (ca.fabs(whole) + none))
    return ca.Function(
        "individual",
        [twist, clearance, angle],
        [whole + stiffness * (twist - inside), stiffness, ca.mmax(force), share, in_range],
        ["twist", "clearance", "angle"],
        ["torque", "stiffness", "max_contact_force", "load_share", "in_range"],
    )


def maximum_stiffness(individual: Individual, lookup: Lookup) -> float:
    """The greatest stiffness, N.m/rad, over one turn of the output.

    Sought with the least clearance at the ends of the twist's range, where the contacts are stiffest, and in its
    middle, where all elements may be preloaded.
    """
    function = individual_function(individual, lookup)
    twist, angle = (
        np.ravel(v)
        for v in np.meshgrid(
            np.linspace(lookup.twist.start, lookup.twist.stop, 3), np.linspace(0, 2 * math.pi, N_ANGLES, endpoint=False)
        )
    )
    return float(np.asarray(function.map(angle.size)(twist, lookup.clearance.start, angle)[1]).max())


def _gather(table: Array, index: ca.MX) -> ca.MX:
    """Entries of a constant table at an index (1, n), as (1, n)."""
    return ca.MX(ca.DM(np.ravel(table)))[index.T].T


def _element_positions(parts: IndividualContacts, angle: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX]:
    """Position beta, rad, number of the element and of its pair with a lobe, (1, width) each.

    As in `stiffness_model.rotation.element_positions`.
    """
    one, window = parts.individual, parts.window
    n, step = one.drive.elements, 2 * math.pi / one.drive.elements
    passed = (one.start + (one.drive.ratio - 1) * angle) / step
    place = ca.ceil(-window.reach / step - passed) + ca.DM(np.arange(window.width)).T
    all_meetings = n * one.drive.lobes
    return (
        (passed + place) * step,
        place - n * ca.floor(place / n),
        place - all_meetings * ca.floor(place / all_meetings),
    )


def _profile(parts: IndividualContacts) -> tuple[Axis, Array]:
    """The coefficients along half of a lobe, (axis.size, COLUMNS)."""
    drive, gear = parts.individual.drive, parts.gear_table
    nodes = gear.axis.nodes
    normal_r, normal_t = drive.path.normal(nodes, drive.orientation)
    # In radial direction the gear is more compliant, by the inclination of the normal.
    compliance = gear.values * (normal_r ** (-1 - 1 / gear.exponent))[:, None]
    path = np.stack([drive.path.radius(nodes), normal_t / normal_r, 1 / normal_r], axis=1)
    return gear.axis, fit(gear.axis, np.hstack([path, compliance]), 0)


def _element(parts: IndividualContacts) -> ca.Function:
    """(coefficients of a cell, its coordinate, beta, sizes of the element, q, twist, clearance) -> (torque, stiffness,
    greatest contact force) of one element, in scalars."""
    drive, gear, window, p = parts.individual.drive, parts.gear_table, parts.window, parts.own_contacts.exponent
    cell, f, beta, sizes, lobe, twist, clearance = (
        ca.SX.sym(name, n)
        for name, n in (
            ("cell", 4 * COLUMNS),
            ("f", 1),
            ("beta", 1),
            ("sizes", 6),
            ("q", 1),
            ("twist", 1),
            ("clearance", 1),
        )
    )
    basis = weights(f, f)
    path, slope, per_n_r, *gear_terms = (
        sum(w * cell[a * COLUMNS + k] for a, w in enumerate(basis)) for k in range(COLUMNS)
    )
    radius, reach, bore, crank_stiffness, crank_root, cage_compliance = (sizes[k] for k in range(6))
    q = lobe + clearance
    off = q - gear.middle
    slope = ca.if_else(beta < 0, -1, 1) * slope
    gear_compliance = crank_root * (gear_terms[0] + off * (gear_terms[1] + off * gear_terms[2]))
    lead = beta + drive.ratio * twist
    centre_r, centre_t = drive.eccentricity * ca.cos(lead), drive.eccentricity * ca.sin(lead)
    wall = ca.if_else(centre_t / (path - centre_r) + slope > 0, -1, 1)
    slope = wall * slope
    touch = (q - radius) * per_n_r - slope * bore
    d_r, d_t = path - centre_r + touch, bore - wall * centre_t

    def one_pass(t: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
        """Root s of the force at an inclination t of the crank's contact, cage force per radial force, 1/u_r, and the
        displacement of the element along the radius and towards its wall."""
        w = ca.fmax(t - slope, MINIMUM_SHARE)
        cage = _power(w, 1 / p) * cage_compliance
        per_u_r = ca.sqrt(1 + t * t)
        compliance = _power_near_one(t * t, (1 + 1 / p) / 2) + gear_compliance + w * cage
        s = ca.fmax((per_u_r * reach - d_r - t * d_t) / compliance, MINIMUM_SHARE * reach)
        return s, w, per_u_r, s * (gear_compliance - slope * cage), s * cage

    s, w, per_u_r, x_r, x_t = one_pass(d_t / d_r)
    for _ in range(LEAN_ITERATIONS - 1):
        s, w, per_u_r, x_r, x_t = one_pass((d_t + x_t) / (d_r + x_r))
    radial = crank_stiffness * s * (ca.sqrt(s) if p == 1.5 else _power(s, p - 1))
    edge = (window.limit - ca.fabs(beta)) / (2 * FADE_HALF_WIDTH) + 0.5 if window.reach < math.pi else ca.SX(1)
    inside = ca.fmax(ca.fmin(edge, 1), 0)
    torque = inside * wall * w * radial * (path + x_r + touch)
    force = (inside > 0) * radial * ca.fmax(per_n_r, ca.fmax(per_u_r, w))
    return ca.Function(
        "element",
        [cell, f, beta, sizes, lobe, twist, clearance],
        [torque, ca.jacobian(torque, twist), force],
        # The entries of constant tables have no derivative.
        {"is_diff_in": [False, True, True, False, False, True, True]},
    )


def _power(x: ca.SX, exponent: float) -> ca.SX:
    """x^exponent, written so that the derivative needs no second power."""
    return ca.exp(exponent * ca.log(x))


def _power_near_one(x: ca.SX, exponent: float) -> ca.SX:
    """(1 + x)^exponent for a small x by its binomial series.

    Here x is the square of the crank's inclination, at most (e/(a + b))^2 or some 1e-3: the fourth term is below 1e-9.
    """
    return 1 + exponent * x * (1 + (exponent - 1) / 2 * x * (1 + (exponent - 2) / 3 * x))
