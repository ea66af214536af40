"""The greatest contact pressures of virtual drives over a turn, which static ratings are about (ISO 76).

A drive that stands shows the elements that happen to be loaded. While it turns, each element keeps its deviations and
passes every place of the profile, and in one turn of the output it meets every lobe of its row (`rotation.individual`).
With the crank's twist given, elements do not feel each other, and a lobe that stands further in presses harder at every
place. So the worst of all n z meetings over all angles is found without turning the drive: it is the worst over
elements and places, each element facing the tightest lobe of its row. At gear and crank the worst element at a place is
the tightest one, by the derivatives of the force with the radii; in the bores, whose conformity counts as well, it is
sought in closed form at a few twists (`TWIST_FRACTIONS`). Only those few are then solved at every twist. Against all
elements at 193 places the greatest pressures of single drives come out right at the gear, whose greatest stands at an
end of the profile, and low by at most 0.06 % at the crank and 1.2 % in the bores (drives 1 to 3).

Where bearing or housing couple the elements, eccentrics and housing are held where the standing drive's equilibrium has
them, while a tight element would push its eccentric away: against whole drives turned, the crank's greatest pressure
comes out 0.4 % low to 4 % high at full twist, up to 7 % high below (bearings of 50 and 250 N/um).

The lobes of a virtual drive: those that its elements face as it stands, and further ones, drawn from a stream of their
own, for those that none faces.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
from ..numerics.arrays import Array
from .pressure import Pressures, element_pressures, expect_memory_for, max_per_drive, wall_forces

Index = NDArray[np.intp]

POSITIONS = 33
"""Places on the profile, both ends of its usable part among them."""
TWIST_FRACTIONS = (1.0, 0.5, 0.2, 0.05)
"""Shares of the greatest twist, either way, at which the worst elements are sought."""
BATCH_SIZE = 2**19
"""Pairs of twist and contact solved at once, for memory."""
_LOBE_STREAM = 1
"""Second number of the key of the stream of further lobes, beside the block's: the virtual drives have one number."""


def peak_pressures(
    drive: Drive, twist: ArrayLike, n_drives: int = 100, seed: int = 0, *, cage: bool = True
) -> Pressures:
    """Greatest pressures over a turn at twists (n_twist,), rad at the output, of the first `n_drives` virtual drives.

    cage: False saves half of the time; the bores' numbers are NaN then. Raises `InputError` as `simulate` does.

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


class _BlockResult(NamedTuple):
    """found: pressure and semi-axes, (3, n_drives, n_twist, 3); lost: cases without an equilibrium, of `cases`."""

    found: Array
    lost: int
    cases: int


def _block(drive: Drive, twist: Array, block: int, n_drives: int, seed: int, cage: bool) -> _BlockResult:
    limit = drive.usable_limit
    if limit <= 0:
        return _BlockResult(np.zeros((3, n_drives, len(twist), len(PARTNERS))), 0, 0)
    drawn = sampling.draw(drive, block, n_drives, seed)
    row = np.arange(drive.elements) % drive.eccentrics
    facing = replace(drawn, gear=smallest_lobe_distances(drive, drawn, block, seed)[:, row])
    beta = np.linspace(-limit, limit, POSITIONS)
    # As if nothing coupled the elements: they stand alone, and so do the places of one.
    alone = replace(drive, beyond=replace(drive.beyond, bearing_stiffness=math.inf, housing_stiffness=math.inf))
    most = float(np.abs(twist).max(initial=0.0))
    trials = np.array([sign * share * most for share in TWIST_FRACTIONS for sign in (1, -1)])
    owner, place, element = critical_contacts(alone, facing, beta, twist if len(twist) <= len(trials) else trials, cage)
    some = replace(Deviations(*(getattr(facing, f.name)[owner, element] for f in fields(Deviations))), beta=beta[place])
    contacts = replace(build_contacts(alone, some), eccentric=owner * drive.eccentrics + row[element])
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
        found.append(max_per_drive(drive, contacts, some, result, owner, n_drives))
    made = np.concatenate(found, axis=2) if found else np.zeros((3, n_drives, 0, len(PARTNERS)))
    if not cage:
        made[..., PARTNERS.index("cage")] = np.nan
    return _BlockResult(made, lost, len(contacts) * len(twist))


def _stationary_equilibrium(drive: Drive, drawn: Deviations, twist: Array) -> CoupledEquilibrium:
    result = solve(usable_elements(drive, drawn).contacts, twist * drive.ratio)
    assert isinstance(result, CoupledEquilibrium)
    return result


def smallest_lobe_distances(drive: Drive, drawn: Deviations, block: int, seed: int) -> Array:
    """Least distance q of the equidistant among the lobes of each row of a block's drives, (n_drives, eccentrics) m."""
    n_drives, per_row = len(drawn.beta), drive.elements_per_row
    # With fewer lobes than elements, two elements at the ends of the period would face one lobe.
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
    """Drive, place and element, (n,) each, of the meetings with the greatest pressures, in the order of the drives.

    facing: (n_drives, n_elements), with the lobe that each element is held against; beta: (n_places,) rad; twist:
    (n_trials,) rad at the output, at which they are compared at the cage; cage: whether there as well.
    """
    n_drives, n_elements = facing.beta.shape
    chosen = np.zeros((n_drives, len(beta), n_elements), bool)
    # At one place gear and crank press all elements in the same proportion, and their curvatures hardly differ: the
    # tightest element has the greatest pressures there.
    fitting = replace(facing, cage=np.maximum(facing.cage, facing.element))
    tight = sum(
        weights[:, None, None] * getattr(fitting, part) for part, weights in _force_sensitivity(drive, beta).items()
    )
    compared = [np.asarray(tight)[None]]
    if cage:
        compared.append(_cage_pressures(drive, facing, beta, twist))
    for values in compared:
        worst = values.argmax(axis=3)
        _, place, owner = np.indices(worst.shape)
        chosen[owner, place, worst] = True
    owner, place, element = np.nonzero(chosen)
    return owner, place, element


def _force_sensitivity(drive: Drive, beta: Array) -> dict[str, Array]:
    """How the force at the crank grows with each radius, N/m at places (n,), of an element under load.

    In proportion these hardly depend on the load, for they come from the directions of the contacts.
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
    # As tight at every place as half of the crank's way at max_twist makes it somewhere.
    tight = mean.gear - drive.eccentricity * abs(drive.ratio) * drive.max_twist / 2
    mean = replace(mean, gear=tight)
    step = 1e-3 * (drive.element_radius - float(tight.min()))

    def force(moved: Deviations) -> Array:
        return closed_form(build_contacts(drive, moved), np.zeros(1)).crank[0]

    return {part: (force(replace(mean, **{part: getattr(mean, part) + step})) - force(mean)) / step for part in size}


def _cage_pressures(drive: Drive, facing: Deviations, beta: Array, twist: Array) -> Array:
    """Pressure in the bores, (n_trials, n_places, n_drives, n_elements) Pa, in closed form."""
    shape = (len(beta), *facing.beta.shape)
    every = Deviations(*(np.broadcast_to(getattr(facing, f.name), shape).ravel() for f in fields(Deviations)))
    every = replace(every, beta=np.broadcast_to(beta[:, None, None], shape).ravel())
    contacts = build_contacts(drive, every)
    result = closed_form(contacts, twist * drive.ratio)
    # A ball larger than its bore presses both walls, which the closed form does not see.
    for plus, minus in zip(result.cage_plus, result.cage_minus, strict=True):
        plus[:] = wall_forces(contacts, plus - minus)[0]
    return element_pressures(drive, contacts, every, result, "cage")[2].reshape(len(twist), *shape)
