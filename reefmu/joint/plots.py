"""Figures of a joint under control: a design for a constant stiffness on the drive's real curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stiffness_model.plotting.style import BLUE, FAINT, INK, RED, drive_name, format_axes, legend_above, new_figure
from stiffness_model.units import quantity_text

from .controller import Design, feedback, minimum_damping_ratio
from .equations import JointModel
from .joint_simulation import Motion, simulate_joint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DASHES = ((6, 1.5), (2, 1))
COLOURS = (RED, BLUE)

STEPS = (0.2e-3, 50e-3)
"""Steps of the set point, rad: one within the soft beginning of the curve, one beyond it."""
LOADS = (1.0, 120.0)
"""Steps of the load, N.m, likewise."""


def picture_designs(joint: JointModel, designs: Sequence[Design]) -> Figure:
    """The curve with the linearisations of the designs, and the damping ratio of each loop over the torque."""
    figure = new_figure(9.6, 4.0)
    left, right = figure.subplots(1, 2)
    tangents(joint, designs, left)
    damping_over_torque(joint, designs, right)
    return figure


def picture_responses(
    joint: JointModel, designs: Sequence[Design], steps: Sequence[float] = STEPS, loads: Sequence[float] = LOADS
) -> tuple[Figure, dict[str, dict[str, float]]]:
    """Responses to steps of the set point, rad, on the left, and to as many of the load, N.m, on the right.

    Also returns the remaining oscillation of the drive's torque, N.m, by case and design (see `response`).
    """
    figure = new_figure(9.6, 3.2 * len(steps))
    axes = figure.subplots(len(steps), 2, squeeze=False)
    left = {
        f"set point {1e3 * step:g} mrad": response(joint, designs, ax, target=step)
        for step, ax in zip(steps, axes[:, 0], strict=True)
    }
    left |= {
        f"load {load:g} N.m": response(joint, designs, ax, load=load)
        for load, ax in zip(loads, axes[:, 1], strict=True)
    }
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=4, frameon=False, fontsize="small")
    return figure, left


def tangents(joint: JointModel, designs: Sequence[Design], ax: Axes) -> Axes:
    """The drive's curve and the linearisation of each design."""
    lookup = joint.drive.lookup
    reach = 0.35 * lookup.twist.stop
    twist = np.linspace(-reach, reach, 400)
    torque = lookup.torque(twist)
    format_axes(ax, "twist at the output [mrad]", "torque [N.m]")
    ax.plot(1e3 * twist, torque, color=INK, lw=2.2, label=drive_name(joint.drive.name))
    for design, colour, dashes in zip(designs, COLOURS, DASHES, strict=False):
        shown = np.abs(design.stiffness * twist) < 1.05 * torque.max()
        ax.plot(
            1e3 * twist[shown],
            design.stiffness * twist[shown],
            color=colour,
            lw=1.6,
            dashes=dashes,
            label=f"{quantity_text(design.stiffness, 'N.m/rad', 3)}, {design.name}",
        )
    ax.locator_params(axis="x", nbins=6)
    return legend_above(ax, "curve of the drive and linearisations of the designs")


def damping_over_torque(joint: JointModel, designs: Sequence[Design], ax: Axes) -> Axes:
    """Minimum damping ratio of the loop over the torque that the joint holds."""
    top = 0.7 * joint.drive.full_torque
    torques = np.concatenate([[0.0], np.geomspace(top / 400, top, 40)])
    format_axes(ax, "torque the joint holds [N.m]", "minimum damping ratio of the loop")
    for design, colour, dashes in zip(designs, COLOURS, DASHES, strict=False):
        ax.plot(
            torques,
            [minimum_damping_ratio(joint, design, torque) for torque in torques],
            color=colour,
            lw=2,
            dashes=dashes,
            label=f"designed {design.name}",
        )
    low = min(-0.3, ax.get_ylim()[0])
    ax.axhspan(low, 0, color="#f3dfd8", zorder=0)
    ax.text(0.97, low / 2, "unstable", color=RED, va="center", ha="right", transform=ax.get_yaxis_transform())
    ax.set_xscale("symlog", linthresh=top / 200, linscale=0.4)
    ax.set_xlim(0, top)
    decades = [d for d in (0.1, 1, 10, 100, 1000) if top / 200 <= d <= top]
    ax.set_xticks([0, *decades], [f"{d:g}" for d in (0, *decades)])
    ax.minorticks_off()
    ax.set_ylim(low, 1.15)
    return legend_above(ax, "the same gains at other torques")


def linear_response(joint: JointModel, design: Design, target: float, load: float, duration: float) -> np.ndarray:
    """output.phi, rad, of the same loop with the linear spring that the design assumes."""
    phi, gamma = joint.masses.step_matrices(design.sample, joint.ratio, design.stiffness)
    controller, motion, angles = feedback(design, joint.ratio, target, load), np.zeros(4), []
    for k in range(round(duration / design.sample) + 1):
        angles.append(motion[2])
        motion = phi @ motion + gamma @ np.array(controller(k * design.sample, motion))
    return np.array(angles)


def run(joint: JointModel, design: Design, target: float, load: float, duration: float) -> Motion:
    """The loop on the real curve; target, rad, and load, N.m, are applied at time 0."""
    return simulate_joint(joint, feedback(design, joint.ratio, target, load), step=design.sample, duration=duration)


def response(
    joint: JointModel,
    designs: Sequence[Design],
    ax: Axes,
    *,
    target: float = 0.0,
    load: float = 0.0,
    duration: float = 0.5,
) -> dict[str, float]:
    """Draws the output angle after a step of set point, rad, or load, N.m; for the first design also with the linear
    spring that it assumes.

    Returns the remaining oscillation by design name: half of peak to peak of the drive's torque in the last fifth of
    the duration, N.m.
    """
    format_axes(ax, "time [s]", "output angle [mrad]")
    left: dict[str, float] = {}
    for design, colour, width in reversed(list(zip(designs, COLOURS, (1.3, 1.8), strict=False))):
        motion = run(joint, design, target, load, duration)
        ax.plot(
            motion.time, 1e3 * motion["output.phi"], color=colour, lw=width, label=f"real curve, designed {design.name}"
        )
        left[design.name] = float(np.ptp(motion["output.tau"][motion.time >= 0.8 * duration])) / 2
    first = designs[0]
    angles = linear_response(joint, first, target, load, duration)
    ax.plot(
        first.sample * np.arange(len(angles)),
        1e3 * angles,
        color=INK,
        lw=1.3,
        dashes=(4, 2),
        label=f"constant {quantity_text(first.stiffness, 'N.m/rad', 3)}, designed {first.name}",
    )
    if target:
        ax.axhline(1e3 * target, color=FAINT, lw=0.8, label="set point")
        ax.set_title(f"Set point step of {1e3 * target:g} mrad", loc="left", fontsize="medium")
    else:
        ax.set_title(f"Load step of {load:g} N.m", loc="left", fontsize="medium")
    ax.set_xlim(0, duration)
    return left
