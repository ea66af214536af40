"""A model's torque in one slow loop of the twist: what its curve, clearance and friction look like."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN, REFERENCE_TEMPERATURE

from .model.drive_model import DriveModel
from .model.signals import CONTACT_LOADS, INPUTS
from .simulate import simulate_signal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PERIOD = 60.0
"""s, of the loop; chosen by judgement: slow enough that damping is small, short enough for creep to show."""
SAMPLES = 481
"""In the loop and the first rise to its end; chosen by judgement."""


def torque_loop(model: DriveModel) -> dict[str, Array]:
    """The model with a locked crank while the output moves from rest through one loop; columns (n,) by their headers.

    The loop reaches to the drawing's max_twist, half of the lookup's range, or to the end of a curve.
    """
    reach = model.lookup.twist.stop
    greatest = reach / 2 if model.lookup.has_contacts else reach
    # From 0 to the positive end, to the negative one and back: a triangle of 5/4 periods.
    phase = np.linspace(0.0, 1.25, SAMPLES)
    twist = greatest * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
    time = PERIOD * phase
    inputs = np.zeros((SAMPLES, len(INPUTS)))
    names = [signal.name for signal in INPUTS]
    inputs[:, names.index("output.phi")] = -twist
    inputs[:, names.index("output.w")] = -np.gradient(twist, time)
    inputs[:, names.index("temperature")] = REFERENCE_TEMPERATURE
    response = simulate_signal(model, time, inputs)
    return {
        "time [s]": time,
        "twist [arcmin]": twist / ARCMIN,
        "torque [N.m]": response["output.tau"],
        "stiffness [N.m/arcmin]": response["stiffness"] * ARCMIN,
        **{f"{s.name} [{s.unit}]": response[s.name] for s in model.outputs if s.name in CONTACT_LOADS},
    }


def plot_loop(model: DriveModel, ax: Axes | None = None) -> Axes:
    """Torque over twist in the loop, on `ax` or on new axes, which are returned."""
    from stiffness_model.plotting.style import BLUE, caption, format_axes, new_axes

    ax = new_axes() if ax is None else ax
    loop = torque_loop(model)
    ax.plot(loop["twist [arcmin]"], loop["torque [N.m]"], color=BLUE, linewidth=1.4)
    inside = ", ".join(effect.name for effect in model.effects) or "no effects"
    return caption(format_axes(ax, "twist [arcmin]", "torque at the output [N.m]"), f"{model.name}: {inside}")
