"""What an FMU computes: signals, parameters and functions, whatever stands behind them.

Both back ends run these functions, so both give the same numbers:

    initial(u, p) -> x          states that fit the first inputs
    advance(x, u, dt, p) -> x   states after dt seconds with the inputs held
    rate(x, u, p) -> dx/dt
    output(x, u, p) -> y
    tangent(x, u, p, d) -> change of (y, dx/dt) for a change d of (u, x)
    max_step(p) -> dt               longest step that `advance` takes at once; None: any
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import InputError, expect
from stiffness_model.io.toml_files import parse_toml

from .kernel import substep_count
from .table_encoding import TABLES, decode_tables

if TYPE_CHECKING:
    import casadi

    from reefmu.model.drive_model import DriveModel, ModelParameter, Signal
    from reefmu.model.masses import Masses
    from stiffness_model.lookup.build_lookup import Lookup

Kind = Literal["drive", "joint"]
KINDS: tuple[Kind, ...] = ("drive", "joint")
MODEL_FILE = "model.toml"
LOOKUP_FILE = "lookup.npz"
JOINT_FILE = "joint.toml"
"""What a component is made of, in `resources`; the last for a joint only."""
METADATA_FILE = "lookup.json"
"""In place of `LOOKUP_FILE` where the tables stand among the sources (`packed.TABLES`)."""


@dataclass(frozen=True)
class Component:
    """Signals and parameters in the order of the vectors u, y, x and p, and the functions on them.

    switches: how many states, from `first_indicator` on, remember the path that others move along; the sign of
    such a state's rate is what switches. full_torque: N.m on the output, the measure of small deviations.
    model: the drive inside.
    """

    kind: Kind
    name: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    states: tuple[Signal, ...]
    parameters: tuple[ModelParameter, ...]
    initial: casadi.Function
    advance: casadi.Function
    rate: casadi.Function
    output: casadi.Function
    full_torque: float
    model: DriveModel
    max_step: casadi.Function | None = None
    first_indicator: int = 0
    n_indicators: int = 0

    @cached_property
    def tangent(self) -> casadi.Function:
        """(x, u, p, d) -> change of outputs and rates for a change d of inputs and states: their directional
        derivative."""
        import casadi as ca

        x, u, p = (
            ca.MX.sym(name, len(items))
            for name, items in (("x", self.states), ("u", self.inputs), ("p", self.parameters))
        )
        d = ca.MX.sym("d", len(self.inputs) + len(self.states))
        together = ca.Function("together", [u, x, p], [ca.vertcat(self.output(x, u, p), self.rate(x, u, p))])
        forward = together.forward(1)
        change = forward(u, x, p, ca.MX(*together.size_out(0)), d[: u.numel()], d[u.numel() :], ca.MX(*p.size()))
        return ca.Function("tangent", [x, u, p, d], [ca.densify(change)], ["x", "u", "p", "d"], ["dy"])

    def parameter_vector(self) -> NDArray[np.float64]:
        """The start values of `parameters`."""
        return np.array([p.value for p in self.parameters])

    def step(self, x: Any, u: Any, dt: float, p: Any) -> Any:
        """States after dt, in as many equal parts as `max_step` asks for."""
        parts = self.substeps(dt, p)
        for _ in range(parts):
            x = self.advance(x, u, dt / parts, p)
        return x

    def substeps(self, dt: float, p: Any) -> int:
        """Number of equal parts of a step of dt seconds."""
        return substep_count(self.max_step, dt, p)


def component_files(kind: str, members: Collection[str]) -> dict[str, str]:
    """What `load_component` needs, and where it stands in an FMU with these members."""
    names = [MODEL_FILE, *([JOINT_FILE] if kind == "joint" else [])]
    if f"resources/{METADATA_FILE}" not in members:
        return {name: f"resources/{name}" for name in (*names, LOOKUP_FILE)}
    return {**{name: f"resources/{name}" for name in (*names, METADATA_FILE)}, TABLES: f"sources/{TABLES}"}


def load_component(folder: Path) -> Component:
    """The component whose files `save_component` wrote or `component_files` names.

    Errors: `InputError` for files that are missing or damaged.
    """
    from reefmu.model.model_file import load_model

    packed = (folder / METADATA_FILE).exists()
    model = load_model(folder / MODEL_FILE, lookup=_encoded_lookup(folder) if packed else folder / LOOKUP_FILE)
    expect(
        model.individual is not None or model.lookup.coefficients.size > 0,
        "an individual where there are no tables",
        "none",
        str(folder / MODEL_FILE),
    )
    masses = folder / JOINT_FILE
    if not masses.exists():
        return drive_component(model)
    from reefmu.model.masses import Masses

    from .joint import joint_component

    try:
        return joint_component(model, Masses(**parse_toml(masses.read_text("utf-8"), str(masses))))
    except (OSError, UnicodeDecodeError, TypeError) as error:
        raise InputError(f"{masses}: expected the masses of a joint, got {error}") from None


def _encoded_lookup(folder: Path) -> Lookup:
    try:
        header, head = ((folder / name).read_text("utf-8") for name in (TABLES, METADATA_FILE))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{folder}: expected a lookup in {TABLES} and {METADATA_FILE}, got {error}") from None
    return decode_tables(header, head, f"{folder / METADATA_FILE} with {TABLES}")


def save_component(model: DriveModel, masses: Masses | None, folder: Path) -> None:
    """Write what a component is made of: model, lookup and, for a joint, masses."""
    import tomli_w

    from reefmu.model.model_file import save_model

    save_model(model, folder / MODEL_FILE)
    model.lookup.save(folder / LOOKUP_FILE)
    if masses is not None:
        (folder / JOINT_FILE).write_text(tomli_w.dumps(dataclasses.asdict(masses)), "utf-8")


def drive_component(model: DriveModel) -> Component:
    """Kind `drive`: angles and speeds in, torques out; the model itself."""
    from reefmu.model.drive_model import INPUTS, OUTPUTS
    from reefmu.model.stages.order import stored_angles

    return Component(
        "drive",
        model.name,
        INPUTS,
        OUTPUTS,
        model.states,
        model.parameters,
        model.initial,
        model.advance,
        model.rate,
        model.output,
        model.full_torque,
        model,
        n_indicators=len(stored_angles(model.effects)),
    )
