"""What one design does: the sweep over its virtual drives, made cheap, and its metrics.

The model is that of `population.simulate`, with the same virtual drives, but for three savings, for an
exploration sweeps thousands of drawings:

* elements where the profile is cut away are left out before their contacts are built;
* the twists end where the mean drive carries the study's torque, and lie denser near zero;
* a ball larger than its bore moves as one that just fits, in closed form and without `newton`; how the two walls
  then share the force between them is exact. With every other ball larger than its bore this changes the
  metrics of drive 1 by less than 1 % (tests/stiffness_model/explore/test_response.py).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from .. import hertz, sampling
from ..contacts import Contacts, build_contacts, compliances, curvature_sums
from ..curve import BAND, TwistTorqueCurve
from ..drive import Drive
from ..equilibrium import Equilibrium, Status, closed_form, solve
from ..geometry import usable_limit
from ..sampling import Deviations

Array = NDArray[np.float64]

MOST_CRANK_TWIST = 0.5
"""Crank twist, rad, up to which the study's torque is looked for. The paper's drives reach 0.07 to 0.34."""
_TRIALS = 24
_TRIAL_ELEMENTS = 48
_MARGIN, _FURTHER, _MOST_SWEEPS = 1.06, 1.3, 5
_DENSER = 1.5
"""Exponent of the spacing of the twists."""
PRESSURE_DRIVES = 16
"""Virtual drives behind the pressure, which goes with the cube root of the force and scatters little."""


@dataclass(frozen=True)
class Response:
    """The virtual drives of one design at n_twist twists from zero to just beyond the study's torque.

    torque: (n_twist, n_drives), N.m; curve: its mean; force: (2, n_drives), N, greatest of any contact at no twist
    and at the torque; force_sum: (n_drives,), N, of all contacts at no twist; share: (n_drives,), greatest load
    share at the torque; pressure: Pa, greatest at gear and crank at the torque, mean of drives; squeezed: share of
    the elements that are larger than their bore.
    """

    torque: Array
    curve: TwistTorqueCurve
    force: Array
    force_sum: Array
    share: Array
    pressure: float
    squeezed: float


def respond(drive: Drive, torque: float, n_drives: int, n_twist: int, seed: int) -> Response | None:
    """Sweep the first `n_drives` virtual drives of `seed` up to `torque`, N.m; None if the drive never carries it."""
    limit = usable_limit(drive.path, drive.element_radius)
    end = _twist_at(drive, torque, limit)
    if end is None:
        return None
    deviations, starts = _draw(drive, limit, n_drives, seed)
    contacts = build_contacts(drive, deviations)
    if not len(contacts):
        return None
    end *= _MARGIN
    for _ in range(_MOST_SWEEPS):
        twist = end * np.linspace(0.0, 1.0, n_twist) ** _DENSER
        result = _equilibrium(contacts, twist * drive.ratio)
        sums = np.add.reduceat(result.output_torque, starts, axis=1)
        mean = sums.sum(axis=1) / n_drives
        if mean[-1] >= torque:
            return _response(drive, deviations, contacts, starts, twist, result, sums, torque, n_drives)
        end *= _FURTHER
    return None


def _twist_at(drive: Drive, torque: float, limit: float) -> float | None:
    """About the output twist, rad, at which a drive without scatter carries `torque`, N.m."""
    if limit <= 0:
        return None
    beta = limit * (2 * (np.arange(_TRIAL_ELEMENTS) + 0.5) / _TRIAL_ELEMENTS - 1)
    radius = {"element": drive.element_radius, "crank": drive.crank_radius, "cage": drive.element_radius,
              "gear": drive.element_radius}
    mean = {part: np.full(beta.shape, size + drive.tolerances[part].offset) for part, size in radius.items()}
    crank_twist = drive.orientation * np.geomspace(1e-4, MOST_CRANK_TWIST, _TRIALS)
    result = closed_form(build_contacts(drive, Deviations(beta=beta, **mean)), crank_twist)
    carried = result.output_torque.mean(axis=1) * drive.elements * limit / np.pi
    reached = np.flatnonzero(carried >= torque)
    if not reached.size:
        return None
    k = int(reached[0])
    twist = crank_twist / drive.ratio
    if k == 0:
        return float(twist[0])
    part = (torque - carried[k - 1]) / (carried[k] - carried[k - 1])
    return float(twist[k - 1] + part * (twist[k] - twist[k - 1]))


def _draw(drive: Drive, limit: float, n_drives: int, seed: int) -> tuple[Deviations, NDArray[np.intp]]:
    """The usable elements of all drives in one row, and where each drive that has any begins."""
    parts = [sampling.draw(drive, block, count, seed) for block, count in sampling.blocks(n_drives)]
    whole = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Deviations)}
    keep = np.abs(whole["beta"]) <= limit
    in_drive = keep.sum(axis=1)
    in_drive = in_drive[in_drive > 0]
    starts = np.concatenate([[0], np.cumsum(in_drive)[:-1]]).astype(np.intp)
    return Deviations(**{name: values[keep] for name, values in whole.items()}), starts


def _equilibrium(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form; the few elements whose passes do not settle go to the iteration."""
    result = closed_form(contacts, crank_twist)
    bad = (result.status == Status.NOT_CONVERGED).any(axis=0)
    if bad.any():
        exact = solve(contacts[bad], crank_twist)
        for f in fields(Equilibrium):
            getattr(result, f.name)[:, bad] = getattr(exact, f.name)
    return result


def _response(drive: Drive, deviations: Deviations, contacts: Contacts, starts: NDArray[np.intp], twist: Array,
              result: Equilibrium, sums: Array, torque: float, n_drives: int) -> Response:
    mean = sums.sum(axis=1) / n_drives
    # A drive none of whose elements is on the profile carries nothing.
    every = np.zeros((len(twist), n_drives))
    every[:, :sums.shape[1]] = sums
    low, high = np.percentile(every, BAND, axis=1)
    nothing = np.full((len(twist), 4), np.nan)
    curve = TwistTorqueCurve(twist, mean, low, high, nothing[:, 0], nothing, nothing[:, 0], drive.name)
    # Forces are taken at the twists around the torque and interpolated between them.
    k = int(np.clip(np.searchsorted(mean, torque), 1, len(twist) - 1))
    part = (torque - mean[k - 1]) / (mean[k] - mean[k - 1])
    rows = np.array([0, k - 1, k])
    walls = _walls(contacts, (result.cage_plus - result.cage_minus)[rows])
    forces = [result.gear[rows], result.crank[rows], walls[0]]
    greatest = np.maximum.reduceat(np.maximum(np.maximum(forces[0], forces[1]), forces[2]), starts, axis=1)
    force = np.zeros((2, n_drives))
    force[:, :len(starts)] = greatest[0], greatest[1] + part * (greatest[2] - greatest[1])
    force_sum = np.zeros(n_drives)
    force_sum[:len(starts)] = np.add.reduceat(sum(values[0] for values in (*forces, walls[1])), starts)
    best = np.maximum.reduceat(result.output_torque[rows[1:]], starts, axis=1)
    share = (best / np.maximum(sums[rows[1:]], 1e-300)).clip(0.0, 1e3)
    return Response(every, curve, force, force_sum, share[0] + part * (share[1] - share[0]),
                    _pressure(drive, deviations, starts, forces, part), float((contacts.cage_gap < 0).mean()))


def _walls(contacts: Contacts, net: Array) -> tuple[Array, Array]:
    """Forces, N, of the loaded and of the other cage wall, (m, n), from the net force between element and cage.

    For a ball that is larger than its bore by 2 a, both walls press: K ((a + x)^p - (a - x)^p) = net, with x the
    shift from the middle, until the other wall lifts at x = a.
    """
    loaded, other = np.abs(net), np.zeros_like(net)
    tight = contacts.cage_gap < 0
    if tight.any():
        p = contacts.exponent
        squeeze = contacts.stiffness_cage[tight] * (-contacts.cage_gap[tight]) ** p
        wanted = loaded[:, tight] / squeeze
        x = np.minimum(wanted / 2**p, 1.0)
        for _ in range(6):
            value = (1 + x) ** p - (1 - x) ** p - wanted
            x = np.clip(x - value / (p * ((1 + x) ** (p - 1) + (1 - x) ** (p - 1))), 0.0, 1.0)
        lifted = wanted >= 2**p
        loaded[:, tight] = np.where(lifted, loaded[:, tight], squeeze * (1 + x) ** p)
        other[:, tight] = np.where(lifted, 0.0, squeeze * (1 - x) ** p)
    return loaded, other


def _pressure(drive: Drive, deviations: Deviations, starts: NDArray[np.intp], forces: list[Array], part: float
              ) -> float:
    """Greatest pressure, Pa, at gear and crank at the torque; mean of the first drives."""
    some = starts[:PRESSURE_DRIVES]
    end = starts[len(some)] if len(some) < len(starts) else len(deviations.beta)
    first = Deviations(**{f.name: getattr(deviations, f.name)[:end] for f in fields(Deviations)})
    compliance, curved, own = compliances(drive), curvature_sums(drive, first), 1 / first.element
    greatest = np.zeros(len(some))
    for contact, values in (("gear", forces[0]), ("crank", forces[1])):
        force = values[1, :end] + part * (values[2, :end] - values[1, :end])
        if drive.element == "ball":
            pressure = hertz.point_contact_ellipse(force, compliance[contact], curved[contact], own)[2]
        else:
            pressure = hertz.line_contact_pressure(force, compliance[contact], curved[contact],
                                                   drive.element_length)[1]
        greatest = np.maximum(greatest, np.maximum.reduceat(pressure, some))
    return float(greatest.mean())
