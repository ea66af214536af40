"""Static safety and bearing life: published numbers, definitions, and refusals."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import optimize

import stiffness_model as sm
from stiffness_model import ARCMIN
from stiffness_model.elasticity import hertz
from stiffness_model.montecarlo.solved_blocks import solved_blocks
from stiffness_model.ratings.bearing_life import bearing_forces, bearing_life
from stiffness_model.ratings.peak_pressure import peak_pressures
from stiffness_model.ratings.static_safety import pressure_limits, static_safety

TWIST = np.array([0.0, 2.0, 4.0, 6.0, 8.0]) * ARCMIN


def test_limits_of_iso_76_and_of_the_drawing() -> None:
    roller = sm.load_drive("drive_1", element="roller", element_length="10 mm")
    assert pressure_limits(roller) == pytest.approx([4000e6] * 3)
    printed = pressure_limits(sm.load_drive("drive_3"))
    assert printed[1] == 4200e6
    assert np.isnan(printed[[0, 2]]).all()
    stated = pressure_limits(sm.load_drive("drive_3", gear_pressure_limit="90 MPa", cage_pressure_limit=80e6))
    assert stated == pytest.approx([90e6, 4200e6, 80e6])


def test_safety_over_torque() -> None:
    drive = sm.load_drive("drive_1")
    strength = static_safety(drive, TWIST, 24)
    pressures = peak_pressures(drive, TWIST, 24)
    np.testing.assert_allclose(strength.safety[:, 1:, :2], 4200e6 / pressures.pressure[:, 1:, :2])
    np.testing.assert_allclose(strength.load_safety[:, 1:], strength.safety[:, 1:] ** 3)
    assert (np.diff(strength.min_safety()[1:]) < 0).all()
    # Nine drives of ten have at least the reported safety at their own worst contact.
    of_drives = strength.safety.min(axis=2)
    assert 2 <= (of_drives < strength.min_safety()).sum(axis=0)[1:].max() <= 3
    assert (strength.min_safety()[1:] < of_drives.mean(axis=0)[1:]).all()
    assert {x.contact for x in strength.governing_contacts()} <= {"gear", "crank", "cage", ""}
    # The convex crank governs, and 4200 MPa are reached within the paper's range.
    assert str(strength.governing_contacts()[-1]) == "crank"
    torque = sm.simulate(drive, TWIST, 24).torque.mean(axis=0)
    permissible = strength.permissible_torque(torque)
    assert permissible.status == "reached"
    assert torque[3] < permissible.torque < torque[4]
    at = np.interp(permissible.torque, torque, TWIST)
    assert static_safety(drive, [at], 24).min_safety()[0] == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize(
    ("name", "tenth", "middle"), [("drive_1", (208, 220), (213, 229)), ("drive_2", (75, 92), (100, 120))]
)
def test_torque_at_the_limit_is_that_of_the_most_loaded_ball(
    name: str, tenth: tuple[float, float], middle: tuple[float, float]
) -> None:
    """An independent computation that turns individuals reaches 4200 MPa at the crank at 213 to 224 N.m (drive 1) and
    90 to 114 N.m (drive 2); at one random angle each, the mean drive reaches it only at 257 and 185 N.m.
    """
    drive = sm.load_drive(name)
    twist = np.linspace(0.1, 1.0, 19) * drive.max_twist
    torque = sm.simulate(drive, twist, 200).torque.mean(axis=0)
    strength = static_safety(drive, twist, 100)
    assert tenth[0] < strength.permissible_torque(torque).torque < tenth[1]
    each = [np.interp(4200e6, pressure, torque) for pressure in strength.pressure[..., 1]]
    assert middle[0] < np.median(each) < middle[1]


def test_limits_not_reached_and_exceeded_are_distinguished() -> None:
    drive = sm.load_drive("drive_1")
    torque = sm.simulate(drive, TWIST, 24).torque.mean(axis=0)
    strength = static_safety(drive, TWIST, 24)
    low, high = (
        dataclasses.replace(strength, twist=TWIST[part], pressure=strength.pressure[:, part])
        for part in (slice(1, 3), slice(4, 5))
    )
    not_reached, exceeded = low.permissible_torque(torque[1:3]), high.permissible_torque(torque[4:])
    assert (not_reached.status, not_reached.torque) == ("not reached", torque[2])
    assert str(not_reached) == f"stays above 1 up to {torque[2]:.0f} N.m"
    assert (exceeded.status, exceeded.torque) == ("exceeded", torque[4])
    assert "is 1 or below already at" in str(exceeded)
    unlimited = dataclasses.replace(strength, limit=np.full(3, np.nan)).permissible_torque(torque)
    assert unlimited.status == "no limit"
    assert math.isnan(unlimited.torque)


def test_load_safety_times_the_force_is_the_force_at_the_limit() -> None:
    """One ball: its force times the load safety is the force at which the pressure reaches the limit."""
    drive = sm.load_drive("drive_1", elements=1, eccentrics=1)
    standing = sm.contact_pressures(drive, TWIST[[4]], 30).pressure
    strength = dataclasses.replace(static_safety(drive, TWIST[[4]], 30), pressure=standing)
    force = sm.simulate(drive, TWIST[[4]], 30).contact_force[:, 0, 1]
    loaded = force > 0
    expected = force[loaded] * strength.load_safety[loaded, 0, 1]
    assert np.ptp(expected) < 0.01 * expected.mean()  # the force at 4200 MPa, the same for all


@pytest.mark.parametrize("element", ["ball", "roller"])
def test_a_load_multiplied_by_its_safety_reaches_the_limit(element: str) -> None:
    """s0 = C0/P0: by Hertz, the force times the load safety has ISO 76's limit as its pressure."""
    drive = sm.load_drive("drive_1", element=element, element_length="12 mm")
    strength = static_safety(drive, TWIST[[2, 4]], 4)
    compliance, radius = 2 * 4.375e-12, 7e-3
    for pressure, safety in zip(strength.pressure[:, :, 1].ravel(), strength.load_safety[:, :, 1].ravel(), strict=True):
        if element == "ball":  # p0 is proportional to the cube root of the force
            grown = hertz.point_contact_ellipse(500 * safety, compliance, 1 / radius + 1 / 41e-3, 1 / radius)[2]
            now = hertz.point_contact_ellipse(500, compliance, 1 / radius + 1 / 41e-3, 1 / radius)[2]
        else:
            grown = hertz.line_contact_pressure(500 * safety, compliance, 1 / radius + 1 / 41e-3, 12e-3)[1]
            now = hertz.line_contact_pressure(500, compliance, 1 / radius + 1 / 41e-3, 12e-3)[1]
        assert pressure * grown / now == pytest.approx({"ball": 4200e6, "roller": 4000e6}[element], rel=1e-9)


def test_without_a_limit_there_is_no_safety() -> None:
    strength = static_safety(sm.load_drive("drive_3"), [20 * ARCMIN], 8)
    assert np.isnan(strength.safety[..., [0, 2]]).all()
    governing = strength.governing_contacts()[0]
    assert governing.contact == "crank"  # the only one known
    # The printed gear under some hundred MPa is reported beside it.
    high = strength.pressure_p90()[0]
    assert governing.no_limit == {"gear": high[0], "cage": high[2]}
    assert high[0] > 200e6
    assert str(governing) == f"crank; no limit known: gear at {high[0] / 1e6:.0f} MPa, cage at {high[2] / 1e6:.0f} MPa"
    unknown = sm.Material("POM", 2.8e9, 0.35, 1410.0)
    all_plastic = sm.load_drive("drive_3", crank_material=unknown)
    nothing = static_safety(all_plastic, [20 * ARCMIN], 8)
    assert np.isnan(nothing.min_safety()).all()
    assert nothing.governing_contacts()[0].contact == ""
    assert list(nothing.governing_contacts()[0].no_limit) == ["gear", "crank", "cage"]


def test_a_material_s_allowable_pressure_is_a_limit_where_both_are_known() -> None:
    printed = sm.Material("PA12", 1.7e9, 0.4, 1010.0, allowable_pressure=80e6, allowable_source="1.6 x yield")
    drive = sm.load_drive("drive_3", gear_material=printed)
    assert pressure_limits(drive)[:2] == pytest.approx([80e6, 4200e6])
    assert np.isnan(pressure_limits(drive)[2])
    roller = sm.load_drive("drive_3", gear_material=printed, element="roller", element_length="10 mm")
    assert pressure_limits(roller)[:2] == pytest.approx([80e6, 4000e6])
    stated = sm.load_drive("drive_3", gear_material=printed, gear_pressure_limit="70 MPa")
    assert pressure_limits(stated)[0] == pytest.approx(70e6)
    # A ball without an allowable pressure leaves no contact with a limit.
    assert np.isnan(pressure_limits(sm.load_drive("drive_1", element_material=sm.MATERIALS["PLA"]))).all()
    with pytest.raises(sm.InputError, match="where the allowable pressure is from"):
        sm.Material("PA12", 1.7e9, 0.4, 1010.0, allowable_pressure=80e6)
    with pytest.raises(sm.InputError, match="positive allowable pressure"):
        sm.Material("PA12", 1.7e9, 0.4, 1010.0, allowable_pressure=-1.0, allowable_source="guess")


def test_bearing_forces_are_the_reaction_to_the_crank_s_torque() -> None:
    """The component across the eccentricity makes the torque; at 250 N/um the displacement carries the same force."""
    drive = sm.load_drive("drive_1")
    force, torque = bearing_forces(drive, TWIST, 24)
    assert force.shape == (24, 3, 5)
    population = sm.simulate(drive, TWIST, 24)
    np.testing.assert_allclose(torque, population.torque, rtol=1e-12)
    across = np.abs(population.crank_torque) / (3 * drive.eccentricity)
    ratio = force[..., -1].mean() / across[:, -1].mean()
    assert 1.05 < ratio < 1.4
    soft = sm.load_drive("drive_1", bearing_stiffness="250 N/um")
    block = next(solved_blocks(soft, TWIST[[4]], 1, 0))
    shift = np.hypot(*block.result.centre_displacement[:, 0])  # type: ignore[attr-defined]
    by_shift = [2.5e8 * shift[block.eccentric == k].mean() for k in range(3)]
    np.testing.assert_allclose(bearing_forces(soft, TWIST[[4]], 1)[0][0, :, 0], by_shift, rtol=1e-7)


def test_life_of_iso_281() -> None:
    ball, roller = (
        sm.load_drive("drive_1", bearing_capacity="40 kN", bearing_type=kind, crank_speed="1500 rpm")
        for kind in ("ball", "roller")
    )
    life = bearing_life(ball, TWIST[1:], 24)
    assert life.revolutions * life.relative_revolutions == pytest.approx(1e6 * (40e3 / life.load) ** 3)
    assert life.hours == pytest.approx(life.system_revolutions / (1500 * 60))
    assert life.system_revolutions == pytest.approx(life.revolutions * 3**-0.9)
    rolling = bearing_life(roller, TWIST[1:], 24)
    assert rolling.revolutions * rolling.relative_revolutions == pytest.approx(1e6 * (40e3 / rolling.load) ** (10 / 3))
    # The mean of order 3 exceeds the arithmetic mean.
    force = bearing_forces(ball, TWIST[1:], 24)[0]
    assert (life.load > force.mean(axis=(0, 1))).all()
    assert np.isnan(bearing_life(sm.load_drive("drive_1", bearing_capacity="40 kN"), TWIST[1:], 4).hours).all()
    assert life.valid.all()
    assert not bearing_life(sm.load_drive("drive_1", bearing_capacity="8 kN"), TWIST[[4]], 4).valid.any()
    with pytest.raises(sm.InputError, match="dynamic load rating"):
        bearing_life(sm.load_drive("drive_1"), TWIST, 4)


@pytest.mark.parametrize(("kind", "order", "weibull"), [("ball", 3, 10 / 9), ("roller", 10 / 3, 9 / 8)])
def test_damage_adds_up_and_bearings_survive_together(kind: str, order: float, weibull: float) -> None:
    """Palmgren and Miner: a revolution at the force F consumes (F/C)^p of a bearing's life. Weibull: all bearings
    survive with the product of their probabilities, 0.9 at the system's life, each with exp(ln 0.9 (t/L)^e).
    """
    drive = sm.load_drive("drive_2", bearing_capacity="40 kN", bearing_type=kind)
    life, force = bearing_life(drive, TWIST[1:], 24), bearing_forces(drive, TWIST[1:], 24)[0]
    spent = ((force / 40e3) ** order).mean(axis=(0, 1))
    assert life.revolutions * life.relative_revolutions == pytest.approx(1e6 / spent, rel=1e-3)
    # Means of other orders differ, since the forces of drive 2 scatter.
    others = [(force**p).mean(axis=(0, 1)) ** (1 / p) for p in (1, 2, order + 1)]
    assert (np.abs(np.array(others) / life.load - 1)[:, 0] > 1e-3).all()
    assert life.load == pytest.approx((force**order).mean(axis=(0, 1)) ** (1 / order), rel=2e-4)
    survival = np.exp(np.log(0.9) * (life.system_revolutions / life.revolutions) ** weibull)
    assert survival**drive.eccentrics == pytest.approx(0.9, rel=1e-12)


@pytest.mark.parametrize(("lobes", "relative"), [(30, 1.0915), (28, 0.9256)])
def test_a_life_counts_the_relative_revolutions_of_the_rings(lobes: int, relative: float) -> None:
    """Rotation of the outer ring from kinematics in the fixed frame: velocities by finite differences of positions over
    a small rotation of the crank, and the minimum of the power lost by sliding by a linear programme.
    """
    exact = {
        f"{part}_{kind}": "0 um" for part in ("element", "crank", "cage", "gear") for kind in ("tolerance", "offset")
    }
    drive = sm.load_drive("drive_1", lobes=lobes, bearing_capacity="40 kN", crank_speed="1500 rpm", **exact)
    twist, h = 0.3 * drive.max_twist, 1e-5
    block = next(solved_blocks(drive, [twist], 1, 0))
    c, force = block.contacts, block.result
    normal = c.normal_r + 1j * c.normal_t
    r, cage = c.element_radius, 1 / drive.ratio

    def places(crank: float) -> tuple[np.ndarray, np.ndarray]:
        """Elements and eccentrics as complex numbers, each relative to an element whose bore is at angle 0."""
        bore = crank * cage
        return (
            drive.path.radius(c.beta + crank - bore) * np.exp(1j * bore),
            drive.eccentricity * np.exp(1j * (c.beta + crank + twist * drive.ratio)),
        )

    (after, centre_after), (before, centre_before) = places(h), places(-h)
    element, centre = (after - before) / (2 * h), (centre_after - centre_before) / (2 * h)
    here, pin = places(0.0)
    to_element = (here - pin) / np.abs(here - pin)

    def along(velocity: np.ndarray, direction: np.ndarray) -> np.ndarray:
        return np.real(velocity * direction.conjugate())

    # Relative velocity of the surfaces: without spin, its change with the element's spin w, and with the ring's W.
    slips = [
        (along(element, 1j * normal), r, 0 * r, force.gear),
        (along(element - centre, 1j * to_element), -r, -(np.abs(here - pin) - r), force.crank),
        *(
            (element.real + side * cage * r, -side * r, 0 * r, wall)
            for side, wall in ((1, force.cage_plus), (-1, force.cage_minus))
        ),
    ]
    turns = []
    for row in range(3):
        some = np.flatnonzero(block.eccentric == row)
        n = len(some)
        # Unknowns: the elements' spins, the ring's rotation, and the magnitude of every sliding velocity.
        cost, upper, bound = np.zeros(n + 1 + 4 * n), [], []
        for k, (still, by_element, by_ring, pressed) in enumerate(slips):
            cost[n + 1 + k * n : n + 1 + (k + 1) * n] = pressed[0, some]
            for sign in (1, -1):
                part = np.zeros((n, len(cost)))
                part[np.arange(n), np.arange(n)] = sign * by_element[some]
                part[:, n] = sign * by_ring[some]
                part[np.arange(n), n + 1 + k * n + np.arange(n)] = -1
                upper.append(part)
                bound.append(-sign * still[some])
        found = optimize.linprog(cost, np.vstack(upper), np.concatenate(bound), bounds=(None, None), method="highs")
        assert found.success
        turns.append(1 - found.x[n])  # the inner ring turns with the crank
    life = bearing_life(drive, [twist], 1)
    assert life.relative_revolutions[0] == pytest.approx(np.mean(turns), abs=2e-3)
    assert life.relative_revolutions[0] == pytest.approx(relative, abs=5e-3)
    # Lives in turns of the crank and in hours follow from ISO 281's revolutions by this ratio.
    of_rings = 1e6 * (40e3 / life.load[0]) ** 3
    assert life.revolutions[0] == pytest.approx(of_rings / life.relative_revolutions[0])
    assert life.hours[0] == pytest.approx(of_rings * 3**-0.9 / life.relative_revolutions[0] / (1500 * 60))
