"""The greatest contact pressures of virtual drives over a turn of the output, on which static ratings are based (ISO
76).

A drive at rest loads only the elements that happen to stand in the load zone. As it turns, each element keeps its
deviations and passes every position of the profile, and in one turn of the output it meets every lobe of its row
(`rotation`). At a given twist of the crank the elements do not affect each other, and a lobe that protrudes
further presses harder at every position. The worst of all n z pairs over all angles can therefore be found without
turning the drive: it is the worst over elements and positions, each element facing the lobe of its row that protrudes
most. At gear and crank the worst element at a position is the one with the greatest interference, by the derivatives of
the force with respect to the radii. In the bores, whose conformity matters as well, it is found in closed form at a few
twists (`TWIST_FRACTIONS`). Only these few contacts are then solved at every twist. Compared with all elements at 193
positions, the greatest pressures of single drives are right at the gear, where the maximum lies at an end of the
profile, and low by at most 0.06 % at the crank and 1.2 % in the bores (drives 1 to 3).

Where a bearing or the housing couples the elements, eccentrics and housing are held in the equilibrium of the drive at
rest, although an element with interference would displace its eccentric: compared with whole drives turned, the crank's
greatest pressure is between 0.4 % too low and 4 % too high at full twist, up to 7 % too high below (bearings of 50 and
250 N/um).

The lobes of a virtual drive are those that its elements face at rest; the lobes that none faces are drawn from a random
stream of their own.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..contact.element_contacts import PARTNERS, build_contacts
from ..contact.usable_elements import usable_elements
from ..drawing import sampling
from ..drawing.drive import Drive
from ..drawing.sampling import Deviations
from ..drawing.twist_limits import expect_twists
from ..equilibrium.closed_form import closed_form, solve
from ..equilibrium.coupled_elements import CoupledEquilibrium, solve_coupled
from ..equilibrium.solution import Equilibrium, Status
from ..errors import expect, warn_not_converged
from ..numerics.arrays import Array, Index
from .pressure import Pressures, element_pressures, expect_memory_for, max_per_drive, wall_forces

POSITIONS = 33
"""Positions on the profile at which contacts are compared, both ends included; 145 positions change pressures by less
than 0.1 % at gear and crank and 1.5 % in the bores.
"""
TWIST_FRACTIONS = (1.0, 0.5, 0.2, 0.05)
"""Fractions of the greatest twist, in both directions, at which the worst elements in the bores are determined."""
BATCH_SIZE = 2**19
"""Pairs of twist and contact solved at once, which limits memory; chosen by judgement."""
_LOBE_STREAM = 1
"""Second number of the seed's key for the further lobes, after the block's; the virtual drives' keys have one number.
"""


def peak_pressures(
    drive: Drive, twist: ArrayLike, n_drives: int = 100, seed: int = 0, *, cage: bool = True
) -> Pressures:
    """Greatest pressures of the first `n_drives` virtual drives over a turn, at twists (n_twist,), rad at the output.

    cage: False skips the bores, which takes half of the time; their values are NaN then. Raises `InputError` as
    `simulate` does.

    >>> from stiffness_model import load_drive
    >>> p = peak_pressures(load_drive("drive_1"), [load_drive("drive_1").max_twist], n_drives=20)
    >>> " ".join(f"{1e-9 * x:.1f} GPa" for x in p.pressure.mean(axis=0)[0])
    '4.3 GPa 4.5 GPa 0.5 GPa'
    """
    angles = expect_twists(drive, twist)
    expect(n_drives >= 1, "at least one drive", n_drives, "n_drives")
    expect_memory_for(n_drives, len(angles))
    blocks = [_block(drive, angles, block, count, seed, cage) for block, count in sampling.blocks(n_drives)]
    warn_not_converged(sum(part.lost for part in blocks), sum(part.cases for part in blocks), drive.name)
    pressure, major, minor = np.concatenate([part.found for part in blocks], axis=1)
    return Pressures(angles, pressure, major, minor)


class _PeakBlock(NamedTuple):
    """found: pressure and semi-axes, (3, n_drives, n_twist, 3); lost: cases without equilibrium, out of `cases`."""

    found: Array
    lost: int
    cases: int


def _block(drive: Drive, twist: Array, block: int, n_drives: int, seed: int, cage: bool) -> _PeakBlock:
    limit = drive.usable_limit
    if limit <= 0:
        return _PeakBlock(np.zeros((3, n_drives, len(twist), len(PARTNERS))), 0, 0)
    drawn = sampling.draw(drive, block, n_drives, seed)
    row = np.arange(drive.elements) % drive.eccentrics
    facing = replace(drawn, gear=smallest_lobe_distances(drive, drawn, block, seed)[:, row])
    beta = np.linspace(-limit, limit, POSITIONS)
    # Without coupling all elements, and all positions of one element, are independent.
    independent = replace(drive, beyond=replace(drive.beyond, bearing_stiffness=math.inf, housing_stiffness=math.inf))
    most = float(np.abs(twist).max(initial=0.0))
    trials = np.array([sign * share * most for share in TWIST_FRACTIONS for sign in (1, -1)])
    trials = twist if len(twist) <= len(trials) else trials
    owner, position, element = critical_contacts(independent, facing, beta, trials, cage)
    radii = (getattr(facing, f.name)[owner, element] for f in fields(Deviations))
    worst = replace(Deviations(*radii), beta=beta[position])
    contacts = replace(build_contacts(independent, worst), eccentric=owner * drive.eccentrics + row[element])
    stationary = _stationary_equilibrium(drive, drawn, twist) if drive.beyond.couples_elements else None
    step, found, lost = max(1, BATCH_SIZE // max(1, len(contacts))), [], 0
    for first in range(0, len(twist), step):
        part = slice(first, first + step)
        crank = twist[part] * drive.ratio
        result: Equilibrium = (
            solve(contacts, crank)
            if stationary is None
            else solve_coupled(contacts, crank, prescribed=stationary.bodies_for(contacts, part))
        )
        lost += int((result.status == Status.NOT_CONVERGED).sum())
        found.append(max_per_drive(drive, contacts, worst, result, owner, n_drives))
    made = np.concatenate(found, axis=2) if found else np.zeros((3, n_drives, 0, len(PARTNERS)))
    if not cage:
        made[..., PARTNERS.index("cage")] = np.nan
    return _PeakBlock(made, lost, len(contacts) * len(twist))


def _stationary_equilibrium(drive: Drive, drawn: Deviations, twist: Array) -> CoupledEquilibrium:
    result = solve(usable_elements(drive, drawn).contacts, twist * drive.ratio)
    assert isinstance(result, CoupledEquilibrium)
    return result


def smallest_lobe_distances(drive: Drive, drawn: Deviations, block: int, seed: int) -> Array:
    """Smallest distance q of the equidistant among each row's lobes, (n_drives, eccentrics) m, of one block."""
    n_drives, per_row = len(drawn.beta), drive.elements_per_row
    # With fewer lobes than elements, two elements at the ends of the period would face the same lobe.
    order = np.abs(drawn.beta).reshape(n_drives, per_row, drive.eccentrics).argsort(axis=1, kind="stable")
    q = np.take_along_axis(drawn.gear.reshape(order.shape), order[:, : drive.lobes], axis=1)
    least = q.min(axis=1)
    if drive.lobes > per_row:
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(seed), spawn_key=(block, _LOBE_STREAM))))
        normal = rng.standard_normal((sampling.BLOCK, drive.eccentrics, drive.lobes - per_row))[:n_drives].min(axis=2)
        gear = drive.tolerances["gear"]
        least = np.minimum(least, drive.element_radius + gear.offset + gear.sigma * normal)
    return least


def critical_contacts(
    drive: Drive, facing: Deviations, beta: Array, twist: Array, cage: bool
) -> tuple[Index, Index, Index]:
    """Drive, position and element, (n,) indices each, of the contacts with the greatest pressures, ordered by drive.

    facing: (n_drives, n_elements), with the lobe that each element is paired with; beta: (n_positions,) rad; twist:
    (n_trials,) rad at the output, for the comparison in the bores; cage: whether to include the bores.
    """
    n_drives, n_elements = facing.beta.shape
    chosen = np.zeros((n_drives, len(beta), n_elements), bool)
    # At one position the forces at gear and crank are proportional to each other, and the elements' curvatures hardly
    # differ: the element with the greatest interference has the greatest pressures.
    fitting = replace(facing, cage=np.maximum(facing.cage, facing.element))
    tight = sum(
        weights[:, None, None] * getattr(fitting, part) for part, weights in _force_sensitivity(drive, beta).items()
    )
    compared = [np.asarray(tight)[None]]
    if cage:
        compared.append(_cage_pressures(drive, facing, beta, twist))
    for values in compared:
        worst = values.argmax(axis=3)
        _, position, owner = np.indices(worst.shape)
        chosen[owner, position, worst] = True
    owner, position, element = np.nonzero(chosen)
    return owner, position, element


def _force_sensitivity(drive: Drive, beta: Array) -> dict[str, Array]:
    """Derivative of the force at the crank with respect to each radius, N/m at positions (n,), for an element under
    load.

    The ratios of these derivatives hardly depend on the load, since they follow from the directions of the contacts.
    """
    size = {
        "element": drive.element_radius,
        "crank": drive.crank_radius,
        "cage": drive.element_radius,
        "gear": drive.element_radius,
    }
    mean = Deviations(
        beta,
        *(
            np.full_like(beta, size[part] + drive.tolerances[part].offset)
            for part in ("element", "crank", "cage", "gear")
        ),
    )
    # An interference that occurs at half of max_twist, applied at every position.
    tight = mean.gear - drive.eccentricity * abs(drive.ratio) * drive.max_twist / 2
    mean = replace(mean, gear=tight)
    step = 1e-3 * (drive.element_radius - float(tight.min()))

    def force(moved: Deviations) -> Array:
        return closed_form(build_contacts(drive, moved), np.zeros(1)).crank[0]

    return {part: (force(replace(mean, **{part: getattr(mean, part) + step})) - force(mean)) / step for part in size}


def _cage_pressures(drive: Drive, facing: Deviations, beta: Array, twist: Array) -> Array:
    """Pressure in the bores, (n_trials, n_positions, n_drives, n_elements) Pa, in closed form."""
    shape = (len(beta), *facing.beta.shape)
    every = Deviations(*(np.broadcast_to(getattr(facing, f.name), shape).ravel() for f in fields(Deviations)))
    every = replace(every, beta=np.broadcast_to(beta[:, None, None], shape).ravel())
    contacts = build_contacts(drive, every)
    result = closed_form(contacts, twist * drive.ratio)
    # A ball larger than its bore presses both walls, which the closed form neglects.
    for plus, minus in zip(result.cage_plus, result.cage_minus, strict=True):
        plus[:] = wall_forces(contacts, plus - minus)[0]
    return element_pressures(drive, contacts, every, result, "cage")[2].reshape(len(twist), *shape)
