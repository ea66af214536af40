"""Whole drives beyond the paper's model: limits, statics, and SciPy's root of the whole coupled system."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy import integrate, optimize
from scipy.interpolate import CubicSpline

import stiffness_model as sm
from stiffness_model import ARCMIN
from stiffness_model.contact.element_contacts import Contacts, build_contacts
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.elasticity import hertz
from stiffness_model.equilibrium.closed_form import Status, closed_form, solve
from stiffness_model.equilibrium.coupled_elements import CoupledEquilibrium, solve_coupled

SOFT = {"bearing_stiffness": "250 N/um"}
HOUSING = {"housing_stiffness": "80 N.m/arcmin"}
SPRINGS = {"ring_stiffness": "400 N/um", "cage_wall_stiffness": "60 N/um"}
MOVING = {"inertia": "on", "crank_speed": "9000 rpm"}
SMALL = {"elements": 19, "eccentrics": 1}
TIGHT = {"cage_offset": "0 um"}
CASES = {
    "bearing": ("drive_1", SOFT),
    "bearing, 28 lobes, tight": ("drive_1", {**SOFT, **TIGHT, "lobes": 28}),
    "bearing, rollers": ("drive_2", {**SOFT, "element": "roller", "element_length": "10 mm"}),
    "housing": ("drive_1", HOUSING),
    "both, tight": ("drive_1", {**SOFT, **HOUSING, **TIGHT}),
    "springs": ("drive_2", SPRINGS),
    "lamina": ("drive_1", {"cage_contact": "lamina"}),
    "exact gear": ("drive_3", {"gear_contact": "exact"}),
    "inertia": ("drive_3", MOVING),
    "everything": (
        "drive_1",
        {**SOFT, **HOUSING, **SPRINGS, **MOVING, "cage_contact": "lamina", "gear_contact": "exact"},
    ),
}


def one_drive(drive: sm.Drive, seed: int = 5, n_drives: int = 1) -> Contacts:
    deviations = sampling.draw(drive, 0, n_drives, seed)
    return usable_elements(drive, deviations).contacts


class WholeDrive:
    """Eqs 8 to 16 for all elements of a drive with one eccentric, its bearing and its housing, as one system.

    Unknowns: the displacement of the eccentric's centre, um; the crank twist taken by the housing, mrad; the elements'
    displacements, um. Shares no code with the solver: forces by root search and quadrature, gaps by a search along
    the path.
    """

    def __init__(self, contacts: Contacts, twist: float) -> None:
        self.c, self.twist = contacts, twist
        self.bearing_yields = math.isfinite(contacts.options.bearing_stiffness)
        self.housing_yields = math.isfinite(contacts.options.housing_stiffness)

    def with_spring(self, law, delta: float, spring: float) -> float:
        if delta <= 0:
            return 0.0
        if math.isinf(spring):
            return law(delta)
        return optimize.brentq(lambda f: f - law(delta - f / spring), 0.0, spring * delta, xtol=1e-12, rtol=1e-15)

    def cage(self, j: int, delta: float) -> float:
        c = self.c
        if c.options.cage_contact == "hertz":
            return c.stiffness_cage[j] * max(delta, 0.0) ** c.exponent
        if delta <= 0:
            return 0.0
        radius, gap = c.element_radius[j], max(c.cage_gap[j], 1e-9 * c.element_radius[j])
        arc = 2 * math.asin(math.sqrt(delta / (2 * (gap + delta))))
        line = 1 / ((2 * arc * radius) ** (1 / 9) * 3.81 ** (10 / 9) * c.cage_compliance / math.pi)

        def slices(v: float) -> float:
            a = arc * math.sin(v)  # vanishes smoothly at the end
            overlap = max(delta * math.cos(a) - 2 * gap * math.sin(a / 2) ** 2, 0)
            return overlap ** (10 / 9) * math.cos(a) * arc * math.cos(v)

        value, _ = integrate.quad(slices, 0, math.pi / 2, epsabs=0, epsrel=1e-9)
        return 2 * line * radius * value

    def gear(self, j: int, x: np.ndarray) -> tuple[float, np.ndarray, float]:
        """Indentation, outward normal and stiffness."""
        c = self.c
        if c.profile is None:
            normal = np.array([c.normal_r[j], c.normal_t[j]])
            return normal @ x - c.gear_gap[j], normal, c.stiffness_gear[j]
        path, beta, side = c.profile.path, c.beta[j], c.profile.orientation
        centre = np.array([path.radius(beta) + x[0], x[1]])

        def point(at: float) -> np.ndarray:
            angle = side * (at - beta) / path.lobes
            return path.radius(at) * np.array([math.cos(angle), math.sin(angle)])

        found = optimize.minimize_scalar(
            lambda at: ((centre - point(at)) ** 2).sum() * 1e12, (beta - 0.05, beta + 0.05), tol=1e-12
        )

        # A minimum is found to the square root of the precision only, the zero of the slope to full precision.
        def slope(at: float) -> float:
            h = 1e-6
            return float((centre - point(at)) @ (point(at + h) - point(at - h)))

        at = optimize.brentq(slope, found.x - 1e-3, found.x + 1e-3, xtol=1e-15)
        tangent = point(at + 1e-6) - point(at - 1e-6)
        normal = np.array([tangent[1], -tangent[0]]) / math.hypot(*tangent)
        normal *= math.copysign(1, normal[0])
        own, q = 1 / c.element_radius[j], c.gear_gap[j] + c.element_radius[j]
        k = path.curvature(at)
        stiffness = hertz.point_stiffness(c.profile.compliance, own - k / (1 + k * q), own)
        return float(normal @ (centre - point(at))) - c.gear_gap[j], normal, float(stiffness)

    def forces(self, j: int, x: np.ndarray, shift: np.ndarray, lost: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Total force on element j, the crank's force on it, both in its frame, and its torque."""
        c, o = self.c, self.c.options
        angle = c.beta[j] + self.twist - lost
        cos, sin = math.cos(c.beta[j]), math.sin(c.beta[j])
        moved = np.array([shift[0] * cos - shift[1] * sin, shift[0] * sin + shift[1] * cos])
        d = np.array([c.path_radius[j], 0]) + x - c.eccentricity * np.array([math.cos(angle), math.sin(angle)]) - moved
        distance = math.hypot(*d)
        delta, normal, stiffness = self.gear(j, x)
        gear = self.with_spring(lambda v: stiffness * max(v, 0.0) ** c.exponent, delta, o.ring_stiffness)
        crank = c.stiffness_crank[j] * max(c.radius_sum[j] - distance, 0.0) ** c.exponent * d / distance
        plus, minus = (
            self.with_spring(lambda v: self.cage(j, v), side * x[1] - c.cage_gap[j], o.cage_wall_stiffness)
            for side in (1, -1)
        )
        total = crank - gear * normal + np.array([0, minus - plus]) + c.load[j]
        return total, crank, (c.path_radius[j] + x[0]) * (plus - minus)

    def residual(self, unknown: np.ndarray) -> np.ndarray:
        shift, lost, x = unknown[:2] * 1e-6, unknown[2] * 1e-3, unknown[3:].reshape(-1, 2) * 1e-6
        on_crank, torque, rows = np.zeros(2), 0.0, []
        for j in range(len(self.c)):
            total, crank, own = self.forces(j, x[j], shift, lost)
            cos, sin = math.cos(self.c.beta[j]), math.sin(self.c.beta[j])
            on_crank += [crank[0] * cos + crank[1] * sin, crank[1] * cos - crank[0] * sin]
            torque += own
            rows += list(total)
        o = self.c.options
        bearing = o.bearing_stiffness * shift + on_crank if self.bearing_yields else unknown[:2]
        housing = o.housing_stiffness * lost / self.c.ratio - torque if self.housing_yields else unknown[2]
        return np.array([*bearing, housing, *rows])


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_the_root_of_the_whole_system(case: str) -> None:
    name, changes = CASES[case]
    drive = sm.load_drive(name, **SMALL, **changes)
    contacts = one_drive(drive)
    twist = 0.7 * drive.max_twist * drive.ratio
    ours = solve(contacts, [twist])
    assert isinstance(ours, CoupledEquilibrium)
    assert not np.any(ours.status == Status.NOT_CONVERGED)
    # The position of unloaded elements is not unique: they are left out. Under inertia all elements are loaded.
    loaded = np.flatnonzero(ours.status[0] != Status.UNLOADED)
    some = contacts[loaded]
    whole = WholeDrive(some, twist)
    cos, sin = np.cos(some.beta[0]), np.sin(some.beta[0])
    places = np.stack([ours.radial[0, loaded], ours.tangential[0, loaded]], axis=1)
    shift = ours.centre_displacement[:, 0, loaded[0]]
    start = np.concatenate(
        [[(shift[0] * cos + shift[1] * sin) * 1e6, (shift[1] * cos - shift[0] * sin) * 1e6, 0.0], places.ravel() * 1e6]
    )
    if whole.housing_yields:
        start[2] = 1e3 * drive.ratio * ours.output_torque.sum() / drive.beyond.housing_stiffness
        start[:2] = 0.0
    # The search starts a tenth off our solution. (Under inertia, where all contacts but the gear's may open, it starts
    # closer, because MINPACK fails otherwise.)
    off = 0.01 if "inertia" in changes else 0.1
    start *= 1 + off * np.random.default_rng(1).uniform(-1, 1, start.size)
    scale = float(ours.crank.max())
    for _ in range(4):  # MINPACK may stall where a contact just opens; a new Jacobian helps
        found = optimize.root(whole.residual, start, method="hybr", options={"xtol": 1e-13})
        start = found.x
        if np.abs(found.fun).max() < 1e-7 * scale:
            break
    assert np.abs(found.fun).max() < 1e-6 * scale, found.message
    x = found.x[3:].reshape(-1, 2) * 1e-6
    theirs = [whole.forces(j, x[j], found.x[:2] * 1e-6, found.x[2] * 1e-3) for j in range(len(some))]
    tight = 1e-6 if case in ("exact gear", "everything") else 1e-7
    np.testing.assert_allclose(
        [math.hypot(*crank) for _, crank, _ in theirs], ours.crank[0, loaded], atol=tight * scale
    )
    torques = np.array([own for _, _, own in theirs])
    np.testing.assert_allclose(torques, ours.output_torque[0, loaded], atol=tight * np.abs(torques).max())
    assert np.count_nonzero(torques) >= 3


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
@pytest.mark.parametrize(
    "stiffness",
    [
        {"bearing_stiffness": 1e30},
        {"housing_stiffness": 1e30},
        {"ring_stiffness": 1e30, "cage_wall_stiffness": 1e30},
        {"bearing_stiffness": 1e30, "housing_stiffness": 1e30, "ring_stiffness": 1e30},
    ],
)
def test_nearly_rigid_bodies_give_the_plain_model(name: str, stiffness: dict[str, float]) -> None:
    twist = np.linspace(-1, 1, 9) * sm.load_drive(name).max_twist
    plain = sm.simulate(sm.load_drive(name), twist, 32)
    rigid = sm.simulate(sm.load_drive(name, **stiffness), twist, 32)
    np.testing.assert_allclose(rigid.torque, plain.torque, atol=1e-10 * plain.torque.max())
    np.testing.assert_allclose(rigid.crank_torque, plain.crank_torque, atol=1e-10 * plain.crank_torque.max())
    np.testing.assert_allclose(rigid.contact_force, plain.contact_force, atol=1e-9 * plain.contact_force.max())
    assert rigid.status_counts == plain.status_counts


def test_options_switched_off_give_the_plain_model_to_the_bit() -> None:
    drive = sm.load_drive("drive_2")
    contacts = one_drive(drive, n_drives=4)
    twist = np.linspace(-1, 1, 5) * drive.max_twist * drive.ratio
    rigid = one_drive(
        sm.load_drive("drive_2", bearing_stiffness="rigid", gear_contact="linear", inertia="on"), n_drives=4
    )
    for field in ("output_torque", "gear", "status"):
        np.testing.assert_array_equal(getattr(solve(rigid, twist), field), getattr(solve(contacts, twist), field))


def test_single_ball_is_its_contacts_and_the_bearing_in_series() -> None:
    """The centre is displaced along the crank's normal by f/k, as if the crank's radius were smaller by that."""
    drive = sm.load_drive("drive_1", elements=1, eccentrics=1, bearing_stiffness="250 N/um")
    contacts = build_contacts(drive, dataclasses.replace(sampling.nominal(drive), beta=np.array([[1.1]])))
    assert len(contacts) == 1
    twist = drive.max_twist * drive.ratio
    result = solve(contacts, [twist])
    force = float(result.crank[0, 0])
    assert force > 50
    shift = math.hypot(*result.centre_displacement[:, 0, 0])  # type: ignore[attr-defined]
    assert shift == pytest.approx(force / 2.5e8, rel=1e-9)
    rigid = dataclasses.replace(
        contacts,
        radius_sum=contacts.radius_sum - shift,
        options=dataclasses.replace(contacts.options, bearing_stiffness=math.inf),
    )
    assert float(solve(rigid, [twist]).crank[0, 0]) == pytest.approx(force, rel=2e-6)


@pytest.mark.parametrize("case", ["bearing", "bearing, 28 lobes, tight", "both, tight", "everything"])
def test_bodies_are_in_equilibrium_with_their_elements(case: str) -> None:
    name, changes = CASES[case]
    drive = sm.load_drive(name, **changes)
    contacts = one_drive(drive, n_drives=3)
    twists = np.array([-0.8, 0.3, 1.0]) * drive.max_twist * drive.ratio
    result = solve(contacts, twists)
    assert isinstance(result, CoupledEquilibrium)
    assert result.bodies_converged.all()
    c, o = contacts, drive.beyond
    cos, sin = np.cos(c.beta), np.sin(c.beta)
    angle = c.beta + twists[:, None]
    torque = np.array([np.bincount(c.eccentric // c.eccentrics, row) for row in result.output_torque])
    lost = drive.ratio * torque / o.housing_stiffness if math.isfinite(o.housing_stiffness) else 0 * torque
    turned = angle - lost[:, c.eccentric // c.eccentrics]
    by_housing = c.eccentricity * np.stack([np.cos(turned) - np.cos(angle), np.sin(turned) - np.sin(angle)])
    by_bearing = result.centre_displacement - by_housing
    d = (
        np.stack([c.path_radius + result.radial, result.tangential])
        - c.eccentricity * np.stack([np.cos(angle), np.sin(angle)])
        - result.centre_displacement
    )
    force = result.crank * d / np.hypot(*d)
    # In the crank's frame all elements of an eccentric see the same displacement y, and k y balances their forces.
    y = np.stack([by_bearing[0] * cos + by_bearing[1] * sin, by_bearing[1] * cos - by_bearing[0] * sin])
    f = np.stack([force[0] * cos + force[1] * sin, force[1] * cos - force[0] * sin])
    for group in np.unique(c.eccentric):
        own = c.eccentric == group
        assert np.ptp(y[..., own], axis=-1).max() < 1e-15
        support = -o.bearing_stiffness * y[..., own].mean(axis=-1)
        np.testing.assert_allclose(support, f[..., own].sum(axis=-1), atol=1e-8 * np.abs(f).max())


@pytest.mark.parametrize("case", CASES)
def test_mirrored_drive_has_mirrored_forces(case: str) -> None:
    """Twisted the other way, the mirrored drive has the same forces and opposite torques."""
    name, changes = CASES[case]
    drive = sm.load_drive(name, **changes)
    contacts = one_drive(drive, n_drives=2)
    mirrored = dataclasses.replace(
        contacts, beta=-contacts.beta, normal_t=-contacts.normal_t, load=contacts.load * [1, -1]
    )
    twist = np.array([0.25, 0.9]) * drive.max_twist * drive.ratio
    one, other = solve(contacts, twist), solve(mirrored, -twist)
    size = float(one.crank.max())
    np.testing.assert_allclose(other.crank, one.crank, atol=2e-8 * size)
    np.testing.assert_allclose(other.cage_minus, one.cage_plus, atol=2e-8 * size)
    np.testing.assert_allclose(other.output_torque, -one.output_torque, atol=2e-8 * np.abs(one.output_torque).max())


def test_drives_are_independent_of_each_other() -> None:
    drive = sm.load_drive("drive_1", **SOFT, **HOUSING)
    twist = np.array([0.4, 1.0]) * drive.max_twist * drive.ratio
    together = solve(one_drive(drive, n_drives=3), twist).output_torque
    alone = solve(one_drive(drive), twist).output_torque
    np.testing.assert_allclose(together[:, : alone.shape[1]], alone, atol=1e-10 * alone.max())


@pytest.mark.parametrize("lobes", [30, 28])
def test_twist_added_by_the_bearing_follows_from_its_energy(lobes: int) -> None:
    """Castigliano: at a given crank torque a bearing adds d(its energy)/d(crank torque) to the crank's twist."""
    twist = np.linspace(1, 8, 43) * ARCMIN
    stiff = sm.load_drive("drive_1", lobes=lobes, bearing_stiffness="4000 N/um")
    rigid, yielding = (
        np.abs(sm.simulate(d, twist, 48).crank_torque).mean(axis=0)
        for d in (sm.load_drive("drive_1", lobes=lobes), stiff)
    )
    middle = 0.7 * yielding[-1]
    torque = middle * np.linspace(0.9, 1.1, 5)
    crank = twist * abs(stiff.ratio)
    added = CubicSpline(yielding, crank)(middle) - CubicSpline(rigid, crank)(middle)
    energy = CubicSpline(yielding, _bearing_energy(stiff, twist, 48))(torque)
    assert added == pytest.approx(np.polyfit(torque - middle, energy, 2)[1], rel=0.01)


def test_twist_added_by_a_bearing_of_250_newtons_per_micrometre() -> None:
    """By hand: 1 um is 0.17 arcmin; 300 N.m put 4.9 kN on each eccentric, which adds 3.3 arcmin.

    That is the force normal to the eccentricity, which makes the torque; the force along it adds a third. At the twist
    of 300 N.m it is 5 % less, because the lever of eq. 19 is that of the displaced element.
    """
    drive = sm.load_drive("drive_1", max_twist="14 arcmin")
    assert 1e-6 / drive.eccentricity / 29 / ARCMIN == pytest.approx(0.17, abs=0.002)
    twist = np.linspace(1, 14, 40) * ARCMIN
    rigid, soft = (sm.simulate(d, twist, 48) for d in (drive, sm.load_drive("drive_1", max_twist="14 arcmin", **SOFT)))
    added = float(soft.curve().twist_at(300.0) - rigid.curve().twist_at(300.0)) / ARCMIN
    force = np.interp(
        300.0, soft.torque.mean(axis=0), np.abs(soft.crank_torque).mean(axis=0) / (3 * drive.eccentricity)
    )
    assert force == pytest.approx(4.9e3, rel=0.07)
    across = force / 2.5e8 / drive.eccentricity / 29 / ARCMIN
    assert across == pytest.approx(3.3, rel=0.07)
    assert 1.2 < added / across < 1.6


def _bearing_energy(drive: sm.Drive, twist: np.ndarray, n_drives: int) -> np.ndarray:
    """Energy in the three bearings, mean over the drives, J."""
    energy = np.zeros(len(twist))
    for block, count in sampling.blocks(n_drives):
        deviations = sampling.draw(drive, block, count, 0)
        contacts = usable_elements(drive, deviations).contacts
        result = solve(contacts, twist * drive.ratio)
        _, first = np.unique(contacts.eccentric, return_index=True)
        shift = result.centre_displacement[..., first]  # type: ignore[attr-defined]
        energy += 0.5 * drive.beyond.bearing_stiffness * (shift**2).sum(axis=(0, 2))
    return energy / n_drives


def test_stiffer_body_makes_a_stiffer_drive() -> None:
    twist = np.array([2.0, 5.0, 8.0]) * ARCMIN
    for field, unit in (
        ("bearing_stiffness", "N/um"),
        ("ring_stiffness", "N/um"),
        ("cage_wall_stiffness", "N/um"),
        ("housing_stiffness", "N.m/arcmin"),
    ):
        torque = [
            sm.simulate(sm.load_drive("drive_1", **{field: f"{k} {unit}"}), twist, 16).torque
            for k in (20, 100, 500, 1e9)
        ]
        for softer, stiffer in itertools.pairwise(torque):
            assert (stiffer > softer).all()


def test_housing_is_a_spring_in_series_with_each_drive() -> None:
    plain, housed = sm.load_drive("drive_1"), sm.load_drive("drive_1", **HOUSING)
    one, other = one_drive(plain), one_drive(housed)
    twist = np.array([0.5, 0.9]) * plain.max_twist
    torque = solve(other, twist * plain.ratio).output_torque.sum(axis=1)
    contacts_see = twist - torque / housed.beyond.housing_stiffness
    np.testing.assert_allclose(solve(one, contacts_see * plain.ratio).output_torque.sum(axis=1), torque, rtol=1e-8)


def test_external_forces_act_together_with_the_bearing() -> None:
    drive = sm.load_drive("drive_1", **SMALL, **SOFT)
    contacts = one_drive(drive)
    twist = [0.6 * drive.max_twist * drive.ratio]
    pushed = solve(contacts, twist, external_force=(25.0, 0.0))
    loaded = solve(dataclasses.replace(contacts, load=np.tile([25.0, 0.0], (len(contacts), 1))), twist)
    np.testing.assert_allclose(pushed.gear, loaded.gear, rtol=1e-9)
    assert (pushed.gear > 20).all()
    with pytest.raises(sm.InputError, match="finite forces of shape"):
        solve(contacts, twist, external_force=(1.0, 2.0, 3.0))


def test_coupled_solver_gives_the_closed_form_of_the_plain_model() -> None:
    drive = sm.load_drive("drive_1", lobes=28)
    contacts = one_drive(drive, n_drives=3)
    twist = np.linspace(-1, 1, 7) * drive.max_twist * drive.ratio
    fits = contacts[contacts.cage_gap >= 0]
    a, b = closed_form(fits, twist), solve_coupled(fits, twist)
    for field in ("gear", "crank", "output_torque", "crank_torque", "radial", "tangential"):
        values = getattr(a, field)
        np.testing.assert_allclose(getattr(b, field), values, atol=1e-10 * np.abs(values).max())
