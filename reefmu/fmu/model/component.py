"""The component inside an FMU: signals, parameters and the functions on them, for either kind.

Both back ends run these functions, so both give the same numbers:

    initial(u, p) -> x          states consistent with the first inputs
    advance(x, u, dt, p) -> x   states after dt seconds at constant inputs
    rate(x, u, p) -> dx/dt
    output(x, u, p) -> y
    tangent(x, u, p, d)         directional derivative of (y, dx/dt) for the direction d of (u, x)
    max_step(p) -> dt           longest step that `advance` accepts; None: any
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

    from reefmu.model.drive_model import DriveModel
    from reefmu.model.masses import Masses
    from reefmu.model.parameters import ModelParameter
    from reefmu.model.signals import Signal
    from stiffness_model.lookup.build_lookup import Lookup

    from .start.start_search import StartFunctions

Kind = Literal["drive", "joint"]
KINDS: tuple[Kind, ...] = ("drive", "joint")
MODEL_FILE = "model.toml"
LOOKUP_FILE = "lookup.npz"
JOINT_FILE = "joint.toml"
"""The files of a component in `resources`; the last one for a joint only."""
METADATA_FILE = "lookup.json"
"""In place of `LOOKUP_FILE` where the sources contain the tables (`table_encoding.TABLES`)."""


@dataclass(frozen=True)
class Component:
    """Signals and parameters in the order of the vectors u, y, x and p, and the functions on them.

    max_step: None where a step may have any length. n_indicators: number of states, from `first_indicator` on, that
    store the angle or twist that other states follow; the rate of such a state is an event indicator, because friction
    changes its direction with the sign of the rate. full_torque: N.m on the output, the reference for small deviations.
    model: the drive inside. start: how the states at the start are found; None where they follow from the angles alone.
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
    start: StartFunctions | None = None

    @cached_property
    def tangent(self) -> casadi.Function:
        """(x, u, p, d) -> directional derivative of outputs and rates for the direction d of inputs and states."""
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
        """The start values of `parameters`, shape (n_parameters,)."""
        return np.array([p.value for p in self.parameters])

    def step(self, x: Any, u: Any, dt: float, p: Any) -> Any:
        """States after dt seconds, in as many equal substeps as `max_step` requires."""
        count = self.substeps(dt, p)
        for _ in range(count):
            x = self.advance(x, u, dt / count, p)
        return x

    def substeps(self, dt: float, p: Any) -> int:
        """Number of equal substeps of a step of dt seconds."""
        return substep_count(self.max_step, dt, p)


def component_files(kind: str, members: Collection[str]) -> dict[str, str]:
    """The files that `load_component` needs and their names in an FMU: file name -> member."""
    names = [MODEL_FILE, *([JOINT_FILE] if kind == "joint" else [])]
    if f"resources/{METADATA_FILE}" not in members:
        return {name: f"resources/{name}" for name in (*names, LOOKUP_FILE)}
    return {**{name: f"resources/{name}" for name in (*names, METADATA_FILE)}, TABLES: f"sources/{TABLES}"}


def load_component(folder: Path) -> Component:
    """The component whose files `save_component` wrote or `component_files` names.

    Errors: `InputError` for files that are missing or damaged.
    """
    from reefmu.model.model_file import load_model

    encoded = (folder / METADATA_FILE).exists()
    model = load_model(folder / MODEL_FILE, lookup=_encoded_lookup(folder) if encoded else folder / LOOKUP_FILE)
    expect(
        model.individual is not None or not model.lookup.has_contacts or model.lookup.coefficients.size > 0,
        "an individual or a curve where there are no tables",
        "none",
        str(folder / MODEL_FILE),
    )
    masses = folder / JOINT_FILE
    if not masses.exists():
        return drive_component(model)
    from reefmu.model.masses import Masses

    from .joint_component import joint_component

    try:
        return joint_component(model, Masses(**parse_toml(masses.read_text("utf-8"), str(masses))))
    except (OSError, UnicodeDecodeError, TypeError) as error:
        raise InputError(f"{masses}: expected the inertias and dampings of a joint, got {error}") from None


def _encoded_lookup(folder: Path) -> Lookup:
    try:
        header, head = ((folder / name).read_text("utf-8") for name in (TABLES, METADATA_FILE))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{folder}: expected a lookup in {TABLES} and {METADATA_FILE}, got {error}") from None
    return decode_tables(header, head, f"{folder / METADATA_FILE} with {TABLES}")


def save_component(model: DriveModel, masses: Masses | None, folder: Path) -> None:
    """Write the files of a component: model, lookup and, for a joint, inertias and dampings."""
    import tomli_w

    from reefmu.model.model_file import save_model

    save_model(model, folder / MODEL_FILE)
    model.lookup.save(folder / LOOKUP_FILE)
    if masses is not None:
        (folder / JOINT_FILE).write_text(tomli_w.dumps(dataclasses.asdict(masses)), "utf-8")


def drive_component(model: DriveModel, *, start: bool = True) -> Component:
    """Kind `drive`: the model itself, with angles and speeds as inputs and torques as outputs.

    start: whether it has parameters for its start (`start`); without them its states are those of the model.
    """
    from reefmu.model.signals import INPUTS
    from reefmu.model.stages.order import stored_angles

    plain = Component(
        "drive",
        model.name,
        INPUTS,
        model.outputs,
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
    if not start:
        return plain
    from .start.starting_drive import starting_drive

    return starting_drive(plain)
