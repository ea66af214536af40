"""The closed form and its two iterated cases against the paper's method, statics and symmetry."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.contact.element_contacts import Contacts
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium import reference
from stiffness_model.equilibrium.closed_form import Equilibrium, Status, solve

FORCES = ("gear", "crank", "cage_plus", "cage_minus")
ROLLER = {"element": "roller", "element_length": "10 mm"}
TIGHT = {"cage_offset": "0 um"}  # half of the elements are larger than their bores
CASES = {
    "drive 1": ("drive_1", {}),
    "drive 2, tight": ("drive_2", TIGHT),
    "drive 3": ("drive_3", {}),
    "drive 1, 28 lobes, tight": ("drive_1", {"lobes": 28, **TIGHT}),
    "drive 2, 28 lobes": ("drive_2", {"lobes": 28}),
    "drive 3, 28 lobes, tight": ("drive_3", {"lobes": 28, **TIGHT}),
    "rollers": ("drive_2", ROLLER),
    "rollers, 28 lobes, tight": ("drive_1", {"lobes": 28, **ROLLER, **TIGHT}),
}


def drawn(drive: sm.Drive, n: int, seed: int) -> Contacts:
    """Contacts of n random usable elements."""
    parts = [
        usable_elements(drive, d).contacts
        for d in (sampling.draw(drive, block, sampling.BLOCK, seed) for block in range(1 + n // 600))
    ]
    joined = dataclasses.replace(
        parts[0],
        **{
            f.name: np.concatenate([getattr(p, f.name) for p in parts])
            for f in dataclasses.fields(Contacts)
            if isinstance(getattr(parts[0], f.name), np.ndarray)
        },
    )
    assert len(joined) >= n
    return joined[np.random.default_rng(seed).permutation(len(joined))[:n]]


def greatest(result: Equilibrium) -> float:
    return max(float(getattr(result, name).max()) for name in FORCES)


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_the_paper_s_method(case):
    """Over all cases 10 000 random elements, each at a random twist: forces to 1e-8 of the greatest."""
    name, changes = CASES[case]
    drive = sm.load_drive(name, **changes)
    contacts = drawn(drive, 1250, seed=list(CASES).index(case))
    twists = np.random.default_rng(1).uniform(-drive.max_twist, drive.max_twist, 25) * drive.ratio
    pairs = []
    for k, twist in enumerate(twists):
        group = contacts[slice(50 * k, 50 * k + 50)]
        # The reference starts at the wall towards which the element is pushed; near beta = 0 there may be a second
        # stable equilibrium at the other wall, with which the solution must not be compared.
        pairs += zip(
            _columns(solve(group, twist)),
            (reference.solve_element(group, j, float(twist)) for j in range(len(group))),
            strict=True,
        )
    assert len(pairs) == 1250
    assert all(b.method != "none" for _, b in pairs)
    assert all(a["status"] != Status.NOT_CONVERGED for a, _ in pairs)
    assert all((a["status"] == Status.UNLOADED) == (b.gear == b.crank == 0) for a, b in pairs)
    for names in (FORCES, ("output_torque",), ("crank_torque",)):
        ours = np.array([[a[name] for name in names] for a, _ in pairs])
        theirs = np.array([[getattr(b, name) for name in names] for _, b in pairs])
        assert np.abs(ours - theirs).max() <= 1e-8 * np.abs(theirs).max()
    loaded = [(a, b) for a, b in pairs if a["status"] != Status.UNLOADED]
    assert 0.3 < len(loaded) / len(pairs) < 0.7
    for name in ("radial", "tangential"):
        ours, theirs = (np.array(v) for v in zip(*((a[name], getattr(b, name)) for a, b in loaded), strict=True))
        np.testing.assert_allclose(ours, theirs, atol=1e-8 * np.abs(theirs).max())
    if "tight" in case:
        assert 0.4 < (contacts.cage_gap < 0).mean() < 0.6
        assert any(a["status"] == Status.ITERATED for a, _ in pairs)


def _columns(result: Equilibrium) -> list[dict[str, float]]:
    names = [f.name for f in dataclasses.fields(result)]
    rows = zip(*(getattr(result, name)[0] for name in names), strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]


@pytest.mark.parametrize("case", CASES)
def test_forces_balance_and_follow_from_the_displacements(case):
    name, changes = CASES[case]
    drive = sm.load_drive(name, **changes)
    contacts = drawn(drive, 1000, seed=11)
    twists = np.linspace(-1, 1, 15) * drive.max_twist * drive.ratio
    result = solve(contacts, twists)
    assert not np.any(result.status == Status.NOT_CONVERGED)
    _assert_statics(contacts, twists, result, np.zeros(2))


def _assert_statics(c: Contacts, twists: np.ndarray, result: Equilibrium, extra: np.ndarray) -> None:
    """Eqs 8-15 with the returned displacements, without any code of the solvers."""
    x, y = result.radial, result.tangential
    angle = c.beta + twists[:, None]
    d = np.stack([c.path_radius - c.eccentricity * np.cos(angle) + x, -c.eccentricity * np.sin(angle) + y])
    u = d / np.hypot(*d)
    size = greatest(result)
    delta = (c.normal_r * x + c.normal_t * y - c.gear_gap, c.radius_sum - np.hypot(*d), y - c.cage_gap, -y - c.cage_gap)
    stiffness = (c.stiffness_gear, c.stiffness_crank, c.stiffness_cage, c.stiffness_cage)
    loaded = (result.status != Status.UNLOADED) | np.any(extra != 0)
    for name, k, indentation in zip(FORCES, stiffness, delta, strict=True):
        expected = k * np.maximum(indentation, 0) ** c.exponent
        np.testing.assert_allclose(getattr(result, name)[loaded], expected[loaded], atol=1e-8 * size)
        assert np.all(getattr(result, name) >= 0)
    radial = -c.normal_r * result.gear + u[0] * result.crank + extra[0]
    tangential = -c.normal_t * result.gear + u[1] * result.crank + result.cage_minus - result.cage_plus + extra[1]
    assert np.abs(radial).max() <= 1e-9 * size
    assert np.abs(tangential).max() <= 1e-9 * size
    # Eq. 19 and the moment of the crank's force about the drive's axis.
    torque = (c.path_radius + x) * (result.cage_plus - result.cage_minus)
    np.testing.assert_allclose(result.output_torque, torque, atol=1e-9 * np.abs(torque).max())
    moment = c.eccentricity * result.crank * (np.cos(angle) * u[1] - np.sin(angle) * u[0])
    np.testing.assert_allclose(result.crank_torque, moment, atol=1e-9 * np.abs(moment).max())


def test_unloaded_elements_have_clearance():
    drive = sm.load_drive("drive_1")
    contacts, twist = drawn(drive, 500, seed=2), 0.001 * drive.ratio
    result = solve(contacts, twist)
    unloaded = result.status[0] == Status.UNLOADED
    assert 0.3 < unloaded.mean() < 0.7
    for name in (*FORCES, "output_torque", "crank_torque"):
        assert not np.any(getattr(result, name)[0, unloaded])
    # At the displacement returned it touches gear and wall but not the crank.
    angle = contacts.beta + twist
    distance = np.hypot(
        contacts.path_radius - contacts.eccentricity * np.cos(angle) + result.radial[0],
        -contacts.eccentricity * np.sin(angle) + result.tangential[0],
    )
    assert np.all(distance[unloaded] >= contacts.radius_sum[unloaded] - 1e-15)
    np.testing.assert_allclose(np.abs(result.tangential[0, unloaded]), contacts.cage_gap[unloaded], rtol=1e-9)


@pytest.mark.parametrize("lobes", [28, 30])
def test_power_balance_of_nominal_parts(lobes):
    """For small twists T_out = i T_crank: the sign of n_t is right for both kinds of drive."""
    drive = sm.load_drive("drive_1", lobes=lobes)
    contacts = _nominal(drive)
    result = solve(contacts, 0.1 * sm.ARCMIN * drive.ratio)
    ratio = result.output_torque.sum() / (drive.ratio * result.crank_torque.sum())
    assert abs(ratio) == pytest.approx(1, abs=1e-3)
    # With the normal of the other flank, the ratio is that of the other kind of drive with as many lobes.
    wrong = dataclasses.replace(contacts, normal_t=-contacts.normal_t)
    result = solve(wrong, 0.1 * sm.ARCMIN * drive.ratio)
    ratio = result.output_torque.sum() / (drive.ratio * result.crank_torque.sum())
    assert abs(ratio) == pytest.approx({28: 27 / 29, 30: 31 / 29}[lobes], abs=2e-3)


def _nominal(drive: sm.Drive) -> Contacts:
    ideal = sampling.nominal(drive, 16)
    return usable_elements(drive, ideal).contacts


@pytest.mark.parametrize("lobes", [28, 30])
def test_positive_twist_gives_positive_torque(lobes):
    drive = sm.load_drive("drive_1", lobes=lobes)
    torque = solve(_nominal(drive), np.array([-1, 1]) * sm.ARCMIN * drive.ratio).output_torque.sum(axis=1)
    assert torque[0] < 0 < torque[1]
    assert torque[0] == pytest.approx(-torque[1], rel=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    lobes=st.sampled_from([28, 30]),
    share=st.floats(-1, 1),
    name=st.sampled_from(["drive_1", "drive_2", "drive_3"]),
    tight=st.booleans(),
)
def test_symmetries(seed, lobes, share, name, tight):
    drive = sm.load_drive(name, lobes=lobes, **(TIGHT if tight else {}))
    contacts = drawn(drive, 60, seed)
    twist = share * drive.max_twist * drive.ratio
    result = solve(contacts, twist)
    size = max(greatest(result), 1e-3)

    mirrored = dataclasses.replace(contacts, beta=-contacts.beta, normal_t=-contacts.normal_t)
    mirror = solve(mirrored, -twist)
    for one, other in (("gear", "gear"), ("crank", "crank"), ("cage_plus", "cage_minus"), ("cage_minus", "cage_plus")):
        np.testing.assert_allclose(getattr(mirror, other), getattr(result, one), atol=1e-9 * size)
    for one in ("output_torque", "crank_torque", "tangential"):
        values = getattr(result, one)
        np.testing.assert_allclose(getattr(mirror, one), -values, atol=1e-9 * np.abs(values).max() + 1e-300)

    # Three times the stiffness at all contacts: the same displacements, three times the forces.
    stiffer = dataclasses.replace(
        contacts, **{f"stiffness_{c}": 3 * getattr(contacts, f"stiffness_{c}") for c in ("gear", "crank", "cage")}
    )
    threefold = solve(stiffer, twist)
    for force in FORCES:
        np.testing.assert_allclose(getattr(threefold, force), 3 * getattr(result, force), atol=1e-9 * size)
        assert np.all(getattr(result, force) >= 0)
        assert np.all(np.isfinite(getattr(result, force)))
    np.testing.assert_allclose(threefold.radial, result.radial, atol=1e-12)

    # A zero external force, which is iterated, gives the closed form.
    none = solve(contacts, twist, external_force=(0.0, 0.0))
    for force in FORCES:
        np.testing.assert_allclose(getattr(none, force), getattr(result, force), atol=1e-8 * size)


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6), lobes=st.sampled_from([28, 30]), name=st.sampled_from(["drive_1", "drive_2", "drive_3"])
)
def test_torque_of_a_drive_rises_with_its_twist(seed, lobes, name):
    drive = sm.load_drive(name, lobes=lobes)
    deviations = sampling.draw(drive, 0, 1, seed)
    contacts = usable_elements(drive, deviations).contacts
    twists = np.linspace(-1, 1, 41) * drive.max_twist
    torque = solve(contacts, twists * drive.ratio).output_torque.sum(axis=1)
    assert np.all(np.diff(torque) >= -1e-9 * np.abs(torque).max())
    assert torque[-1] > 0 > torque[0]


@pytest.mark.parametrize("case", ["drive 1", "drive 2, tight", "drive 3, 28 lobes, tight", "rollers"])
def test_radial_external_force(case):
    name, changes = CASES[case]
    drive = sm.load_drive(name, **changes)
    contacts = drawn(drive, 400, seed=21)
    twists, push = np.linspace(-1, 1, 5) * drive.max_twist * drive.ratio, 40.0
    free = solve(contacts, twists)
    result = solve(contacts, twists, external_force=(push, 0.0))
    assert np.all(np.isin(result.status, (Status.UNLOADED, Status.ITERATED)))
    _assert_statics(contacts, twists, result, np.array([push, 0.0]))
    # It presses the elements against the gear and relieves the crank.
    assert np.all(result.gear > free.gear)
    loaded = free.crank > 0
    assert np.all(result.crank[loaded] < free.crank[loaded])
    # Elements with enough clearance are supported by gear and wall alone.
    supported = result.crank == 0
    assert supported.mean() > 0.3
    np.testing.assert_allclose((result.gear * contacts.normal_r)[supported], push, rtol=1e-8)
    wall = (result.cage_plus - result.cage_minus)[supported]
    expected = np.broadcast_to(-push * contacts.normal_t / contacts.normal_r, result.gear.shape)
    np.testing.assert_allclose(wall, expected[supported], atol=1e-6)


def test_external_forces_per_element_agree_with_the_reference():
    drive = sm.load_drive("drive_1", **TIGHT)
    contacts = drawn(drive, 120, seed=31)
    rng = np.random.default_rng(5)
    extra = np.stack([rng.uniform(1, 80, 120), rng.uniform(-20, 20, 120)])
    twist = 0.4 * drive.max_twist * drive.ratio
    result = solve(contacts, twist, external_force=extra)
    assert not np.any(result.status == Status.NOT_CONVERGED)
    size = greatest(result)
    for j in range(len(contacts)):
        start = result.radial[0, j] + 1e-7, result.tangential[0, j]
        theirs = reference.solve_element(contacts, j, twist, (extra[0, j], extra[1, j]), start=start)
        for name in FORCES:
            assert getattr(result, name)[0, j] == pytest.approx(getattr(theirs, name), abs=1e-8 * size)


def test_arrays_have_the_shape_twists_by_elements():
    drive = sm.load_drive("drive_1")
    contacts = drawn(drive, 30, seed=1)
    twists = np.linspace(-0.05, 0.05, 7)
    result = solve(contacts, twists)
    for field in dataclasses.fields(result):
        assert getattr(result, field.name).shape == (7, 30)
    # Every pair of element and twist is solved independently.
    one = solve(contacts[slice(11, 12)], twists[3])
    assert one.gear.shape == (1, 1)
    assert one.gear[0, 0] == pytest.approx(result.gear[3, 11], rel=1e-9)
    assert solve(contacts[slice(0, 0)], twists).gear.shape == (7, 0)


def test_element_without_equilibrium_does_not_affect_the_others():
    contacts = drawn(sm.load_drive("drive_1"), 20, seed=1)
    broken = dataclasses.replace(contacts, stiffness_gear=np.where(np.arange(20) == 4, np.nan, contacts.stiffness_gear))
    expected, result = solve(contacts, 0.03), solve(broken, 0.03)
    others = np.arange(20) != 4
    assert result.status[0, 4] == Status.NOT_CONVERGED
    assert result.gear[0, 4] == result.output_torque[0, 4] == 0
    np.testing.assert_allclose(result.gear[0, others], expected.gear[0, others], rtol=1e-9)


@pytest.mark.parametrize(
    ("twist", "extra", "parts"),
    [
        (math.nan, None, ["twist", "finite", "nan"]),
        ([[0.0]], None, ["twist", "one dimension"]),
        (0.01, (1.0, 2.0, 3.0), ["external_force", "shape (2,) or (2, 5)", "(3,)"]),
        (0.01, (math.inf, 0.0), ["external_force", "finite"]),
    ],
)
def test_bad_input_is_refused(twist, extra, parts):
    contacts = drawn(sm.load_drive("drive_1"), 5, seed=1)
    with pytest.raises(sm.InputError) as error:
        solve(contacts, twist, extra)
    assert all(part in str(error.value) for part in parts), str(error.value)
