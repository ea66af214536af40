"""Contact options
===============

The contact options of a drawing, each compared with the plain contact model for drive 1, and ratings of the forces.

::

    python examples/contact_options.py [FOLDER]

Writes twist.png (twist over torque, and the twist that each option adds), gear_and_bore.png (error of the linearised
gear over the twist; force in a conforming bore and by Hertz) and loads.png (static safety, efficiency and bearing life
over torque) to FOLDER (default contact-options).
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import stiffness_model as sm
from stiffness_model.elasticity import hertz
from stiffness_model.elasticity.conformal import Lamina
from stiffness_model.numerics.arrays import Array
from stiffness_model.plotting import style
from stiffness_model.ratings.bearing_life import bearing_life
from stiffness_model.ratings.efficiency import friction_losses
from stiffness_model.ratings.static_safety import static_safety
from stiffness_model.units import ARCMIN

DRIVES = 64
OPTIONS: dict[str, dict[str, str]] = {
    "crank bearing 250 N/um": {"bearing_stiffness": "250 N/um"},
    "housing 200 N.m/arcmin": {"housing_stiffness": "200 N.m/arcmin"},
    "ring 500 N/um": {"ring_stiffness": "500 N/um"},
    "cage wall 100 N/um": {"cage_wall_stiffness": "100 N/um"},
    "conforming bore": {"cage_contact": "lamina"},
    "exact gear": {"gear_contact": "exact"},
    "inertia at 3000 rpm": {"inertia": "on", "crank_speed": "3000 rpm"},
}
LINES = (
    style.Line(style.BLUE),
    style.Line(style.RED, (6, 1.5)),
    style.Line(style.GREEN, (6, 1.5, 1, 1.5)),
    style.Line(style.ORANGE, (3, 1.5)),
    style.Line(style.PURPLE),
    style.Line(style.SKY, (6, 1.5)),
    style.Line(style.FAINT, (1, 1.2)),
)


def main(folder: Path) -> None:
    """Compute, print and draw."""
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", sm.DoesNotFitWarning)
    twist_over_torque(folder)
    gear_and_bore(folder)
    loads(folder)


def twist_over_torque(folder: Path) -> None:
    """Each option alone, compared with the plain model."""
    # Softer drives need more twist for the same torque; the steps resolve the twist that the smallest option adds.
    twist = np.linspace(0.25, 14, 36) * ARCMIN
    torque = np.array([25.0, 50.0, 100.0, 150.0, 200.0, 250.0])

    def curve(**fields: str) -> sm.TwistTorqueCurve:
        drive = sm.load_drive("drive_1", max_twist="14 arcmin", **fields)
        return sm.simulate(drive, twist, 16 if "inertia" in fields else DRIVES).curve()

    # Inertia is iterated and gets fewer drives; it is compared with the plain model of the same drives.
    plain = curve()
    few = sm.simulate(sm.load_drive("drive_1", max_twist="14 arcmin"), twist, 16).curve()
    figure = Figure(figsize=(11.5, 5.0), dpi=130, layout="constrained")
    left, right = (figure.add_subplot(1, 2, k) for k in (1, 2))
    left.plot(plain.torque, plain.twist / ARCMIN, color=style.INK, linewidth=2.2, label="plain contacts")
    print("twist added to the plain model's, arcmin, at N.m:", " ".join(f"{t:.0f}" for t in torque))
    for (name, fields), line in zip(OPTIONS.items(), LINES, strict=True):
        found = curve(**fields)
        against = few if "inertia" in fields else plain
        added = (found.twist_at(torque) - against.twist_at(torque)) / ARCMIN
        print(f"  {name:24}", " ".join(f"{a:8.4f}" for a in added))
        left.plot(
            found.torque, found.twist / ARCMIN, color=line.colour, linestyle=line.style, linewidth=1.5, label=name
        )
        right.plot(
            torque, np.abs(added), color=line.colour, linestyle=line.style, linewidth=1.5, marker="o", markersize=3
        )
    style.format_axes(left, "torque at the output [N.m]", "twist at the output [arcmin]")
    style.format_axes(right, "torque at the output [N.m]", "twist added, magnitude [arcmin]")
    left.set_xlim(0, 300)
    left.set_ylim(0, 14)
    right.set_yscale("log")
    right.set_xlim(0, 260)
    figure.legend(loc="outside upper center", ncols=4, frameon=False, handlelength=2.8, labelcolor=style.INK)
    figure.savefig(folder / "twist.png")


def gear_and_bore(folder: Path) -> None:
    """Errors of the linearised gear and of Hertz's contact in the bore."""
    figure = Figure(figsize=(11.0, 4.2), dpi=130, layout="constrained")
    left, right = (figure.add_subplot(1, 2, k) for k in (1, 2))
    share = np.linspace(0.1, 1.0, 10)
    # A cycloidal drive, which is a preset too, has no bores.
    drives = (drive for drive in map(sm.load_drive, sm.presets()) if isinstance(drive, sm.Drive))
    for drive, line in zip(drives, style.DRIVES, strict=False):
        name = drive.name
        plain, exact = (
            sm.simulate(sm.load_drive(name, gear_contact=kind), share * drive.max_twist, DRIVES).torque.mean(axis=0)
            for kind in ("linear", "exact")
        )
        error = 100 * (plain / exact - 1)
        print(f"linearised gear, {name}: torque too high by {error[4]:.2f} % at half, {error[-1]:.2f} % at full twist")
        left.plot(100 * share, error, color=line.colour, linestyle=line.style, label=name.replace("_", " "))
    style.format_axes(left, "share of full twist [%]", "linearised gear: torque too high by [%]")
    style.start_axes_at_zero(left)
    style.legend_above(left)

    radius, compliance = 7e-3, 2 * sm.MATERIALS["100Cr6"].compliance
    approach = np.linspace(0, 4e-6, 81)
    for clearance, line in zip((0.3e-6, 1.25e-6, 5e-6), style.DRIVES, strict=False):
        law = Lamina(np.array([radius]), np.array([clearance]), compliance)
        k = float(hertz.point_stiffness(compliance, 1 / radius - 1 / (radius + clearance), 1 / radius))
        force = law.force(approach[:, None])[0][:, 0]
        right.plot(1e6 * approach, force, color=line.colour, label=f"{1e6 * clearance:g} um")
        right.plot(1e6 * approach, k * approach**1.5, color=line.colour, linestyle=(0, (3, 1.5)), linewidth=1.2)
        print(
            f"bore {1e6 * clearance:g} um wider than the ball, 3 um deep: {force[60]:.0f} N, by Hertz "
            f"{k * approach[60] ** 1.5:.0f} N"
        )
    style.format_axes(right, "approach at the wall [um]", "force on the wall [N]")
    right.set_xlim(0, 4)
    right.set_ylim(0, 2500)
    style.legend_above(right, "clearance of the radii; solid: slices, dashed: Hertz, capped")
    figure.savefig(folder / "gear_and_bore.png")


def loads(folder: Path) -> None:
    """Static safety, efficiency and bearing life."""
    fields = {"friction_coefficient": 0.05, "bearing_capacity": "40 kN", "crank_speed": "1500 rpm"}
    figure = Figure(figsize=(12.5, 4.2), dpi=130, layout="constrained")
    safety, efficiency, life = (figure.add_subplot(1, 3, k) for k in (1, 2, 3))
    for label, name, extra, line in (
        ("drive 1", "drive_1", {}, style.DRIVES[0]),
        ("drive 2", "drive_2", {}, style.DRIVES[1]),
        (
            "drive 1, crank bearing 250 N/um",
            "drive_1",
            {"bearing_stiffness": "250 N/um", "max_twist": "12.6 arcmin"},
            style.DRIVES[3],
        ),
    ):
        drive = sm.load_drive(name, **fields, **extra)
        twist = np.linspace(0.02, 1, 20) * drive.max_twist
        torque = sm.simulate(drive, twist, DRIVES).torque.mean(axis=0)
        strength = static_safety(drive, twist, DRIVES)
        losses = friction_losses(drive, twist, 16)
        bearing = bearing_life(drive, twist, DRIVES)
        draw(safety, torque, strength.min_safety(), line, label)
        draw(efficiency, torque, 100 * losses.mean_efficiencies()[0], line, label)
        draw(life, torque, bearing.hours, line, label)
        print(
            f"{label}: static safety {strength.permissible_torque(torque)} "
            f"({strength.governing_contacts()[-1]} governs); "
            f"at {torque[-1]:.0f} N.m efficiency {100 * losses.mean_efficiencies()[0][-1]:.1f} %, bearings "
            f"{bearing.hours[-1]:.0f} h; no-load torque at the crank {1e3 * losses.loss[:, 0].mean():.0f} mN.m"
        )
    safety.axhline(1, color=style.FAINT, linewidth=0.8)
    for ax, text in (
        (safety, "pressure limit / greatest pressure"),
        (efficiency, "efficiency, friction 0.05 [%]"),
        (life, "L10 of the crank bearings, C = 40 kN [h]"),
    ):
        style.format_axes(ax, "torque at the output [N.m]", text)
        ax.set_xlim(0, 300)
    safety.set_ylim(0, 3)
    efficiency.set_ylim(50, 100)
    life.set_yscale("log")
    life.set_ylim(1e3, 1e7)
    figure.legend(
        *safety.get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False, handlelength=2.8
    )
    figure.savefig(folder / "loads.png")


def draw(ax: Axes, torque: Array, values: Array, line: style.Line, label: str) -> None:
    """Draw one curve over the torque."""
    ax.plot(torque, values, color=line.colour, linestyle=line.style, linewidth=1.8, label=label)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "contact-options"))
