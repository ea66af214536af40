"""Cycloidal discs against an independent solution: exact flanks, finite rotations, SciPy's minimiser of the energy.

It shares the drawing and the equation of the line contact with the package, but no geometry: the distance of a pin from
the flank is that of the nearest point of the curve, and all angles are finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize

from stiffness_model.cycloidal.cycloidal_drive import CycloidalDrive
from stiffness_model.cycloidal.gear_equilibrium import solve_gears
from stiffness_model.cycloidal.part_deviations import PartDeviations, draw_deviations
from stiffness_model.elasticity.hertz import line_stiffness
from tests.cycloidal_drives import TOLERANCES, cycloidal


@dataclass
class ExactDisc:
    """One disc of a drive with its own deviations; poses are absolute: centre (x, y), m, and angle, rad."""

    drive: CycloidalDrive
    parts: PartDeviations
    twist: float

    def __post_init__(self) -> None:
        drive, z = self.drive, self.drive.lobes
        self.start = float(self.parts.crank_angle[0])
        t = np.linspace(0, 2 * np.pi, 60001)
        path = drive.pin_circle_radius * np.exp(1j * t) - drive.eccentricity * np.exp(1j * drive.pins * t)
        slope = drive.pin_circle_radius * 1j * np.exp(1j * t) - 1j * drive.pins * drive.eccentricity * np.exp(
            1j * drive.pins * t
        )
        self.lobe = np.floor(z * t / (2 * np.pi)).astype(int) % z
        form = self.parts.lobe[0, 0][self.lobe] - drive.profile_clearance
        outwards = -1j * slope / np.abs(slope)
        self.flank = path + (form - drive.pin_radius) * outwards
        place = 2 * np.pi * np.arange(drive.pins) / drive.pins
        position = self.parts.pin_position[0]
        self.pins = (drive.pin_circle_radius + position[:, 0] + 1j * position[:, 1]) * np.exp(1j * place)
        self.holes = 2 * np.pi * np.arange(drive.output_rollers) / drive.output_rollers
        moved = self.parts.roller_position[0]
        self.rollers = (drive.roller_circle_radius + moved[:, 0] + 1j * moved[:, 1]) * np.exp(
            1j * (self.holes - self.start / z)
        )
        compliance = drive.materials["disc"].compliance
        self.k_pin, self.k_roller = (
            float(line_stiffness(compliance + drive.materials[part].compliance, drive.disc_thickness))
            for part in ("ring", "roller")
        )
        self.crank = drive.eccentricity * np.exp(1j * (self.start + drive.ratio * self.twist))

    def approaches(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Approaches of pins and rollers, m, and the directions from the holes' centres to the rollers."""
        drive, centre, angle = self.drive, pose[0] + 1j * pose[1], pose[2]
        own = (self.pins - centre) * np.exp(-1j * angle)
        pins = np.empty(len(own))
        for j, pin in enumerate(own):
            squares = np.abs(self.flank - pin) ** 2
            k = int(squares.argmin())
            a, b, c = squares[[k - 1, k, (k + 1) % (len(squares) - 1)]]
            # The square of the distance is a parabola near the nearest point.
            pins[j] = drive.pin_radius + self.parts.pin[0, j] - np.sqrt(b - (a - c) ** 2 / (8 * (a - 2 * b + c)))
        position = self.parts.hole_position[0, 0]
        holes = centre + (drive.roller_circle_radius + position[:, 0] + 1j * position[:, 1]) * np.exp(
            1j * (self.holes + angle)
        )
        offset = self.rollers - holes
        clearance = drive.eccentricity + drive.hole_clearance + self.parts.hole[0, 0] - self.parts.roller[0]
        return pins, np.abs(offset) - clearance, offset / np.abs(offset)

    def energy(self, scaled: np.ndarray) -> float:
        pins, rollers, _ = self.approaches(self.pose(scaled))
        x, y, _ = self.pose(scaled)
        p = 10 / 9
        stored = sum(
            (k * np.maximum(d, 0.0) ** (p + 1)).sum() / (p + 1)
            for k, d in ((self.k_pin, pins), (self.k_roller, rollers))
        )
        return float(stored + self.drive.bearing_stiffness * abs(x + 1j * y - self.crank) ** 2 / 2)

    def pose(self, scaled: np.ndarray) -> np.ndarray:
        """Absolute pose from displacements in um and mrad of the disc in mesh at the twist's half."""
        start = self.drive.eccentricity * np.exp(1j * self.start)
        return np.array([start.real, start.imag, -self.start / self.drive.lobes]) + scaled * [1e-6, 1e-6, 1e-4]

    def solved(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Torque on the output, N.m, and forces of pins and rollers, N, at the least energy."""
        simplex = np.vstack([np.zeros(3), 20 * np.eye(3)])
        found = minimize(
            self.energy, np.zeros(3), method="Nelder-Mead",
            options={"xatol": 1e-5, "fatol": 1e-16, "maxiter": 4000, "initial_simplex": simplex},
        )  # fmt: skip
        pins, rollers, direction = self.approaches(self.pose(found.x))
        f_pin, f_roller = (
            k * np.maximum(d, 0.0) ** (10 / 9) for k, d in ((self.k_pin, pins), (self.k_roller, rollers))
        )
        # A hole pulls its roller back towards its centre.
        torque = (np.conj(self.rollers) * (-f_roller * direction)).imag.sum()
        return float(torque), f_pin, f_roller


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fields", "tolerance"),
    [
        ({"bearing_stiffness": 2e7}, 0.01),
        ({"bearing_stiffness": 2e7, "profile_clearance": 40e-6, "hole_clearance": 30e-6, **TOLERANCES}, 0.02),
        ({"bearing_stiffness": 3e6, "profile_clearance": 40e-6, "hole_clearance": 30e-6, **TOLERANCES}, 0.02),
    ],
)
def test_torques_and_forces_are_those_of_the_exact_geometry(fields: dict[str, float], tolerance: float) -> None:
    drive = cycloidal(**fields)
    parts = draw_deviations(drive, 0, 3, seed=5)
    for k in range(2):
        one = parts[k : k + 1]
        for twist in (2e-3, 12e-3, -12e-3):
            torque, pins, rollers = ExactDisc(drive, one, twist).solved()
            found = solve_gears(drive, one, np.array([twist]))
            scale = max(float(np.concatenate([pins, rollers]).max()), 5.0)
            # Where contact sets in, the error of the gaps, some 0.1 um, makes some 0.01 N.m.
            assert float(found.torque[0, 0]) == pytest.approx(torque, rel=tolerance, abs=0.02)
            np.testing.assert_allclose(found.pin_force[0, 0, 0], pins, atol=4 * tolerance * scale)
            np.testing.assert_allclose(found.roller_force[0, 0, 0], rollers, atol=4 * tolerance * scale)
