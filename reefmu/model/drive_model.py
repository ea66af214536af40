"""The drive model: the contact lookup and the effects along the drive, as CasADi functions.

Simulation, FMUs, generated C and python-control all evaluate these functions:

    initial(u, p) -> x              states that fit the first inputs
    advance(x, u, dt, p) -> x       exact state update; inputs held over dt
    settle(x, u, p) -> x            states after the torque has been held for long
    rate(x, u, p) -> dx/dt          the same states in continuous time
    output(x, u, p) -> y            outputs; jacobian(x, u, p) -> dy/du with the states held

Signs: twist = crank angle/ratio - output angle, ratio signed; torques are what the drive exerts, positive
output torque for positive twist.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from stiffness_model.display import dataframe, html_table, view
from stiffness_model.errors import InputError
from stiffness_model.io.drawing_toml import DriveLike, as_any_drive, as_drive, drive_from_dict
from stiffness_model.kinds import CONTACT_RESPONSES, INDIVIDUALS, TOLERANCES, expect_has, kind_of
from stiffness_model.lookup.build_lookup import N_DRIVES, Lookup
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.numerics.arrays import equal_values
from stiffness_model.rotation import Individual, draw_individual

from ..effects import Effect
from .chosen_effects import NEED_PARTS, chosen_values, in_order, inherent_effects, state_signals
from .contacts.element import with_contact_tables
from .contacts.tables import cached_lookup
from .parameters import ModelParameter, model_parameters, with_values
from .signals import CONTACT_LOADS, Signal, outputs_of
from .stages.composition import Composition
from .stages.order import stored_angles

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class DriveModel:
    """A drive as a component: its lookup, the effects inside and their parameters.

    name: as of its drawing. parameters: "ratio", "band", then "<effect>.<parameter>". The vectors p, u, x and y are in
    the order of `parameters`, `INPUTS`, `states` and `outputs`. individual: one drive with its own parts, whose torque
    changes as it turns, instead of the mean of all; its lookup then gives the range and the drawing. twist_zero: rad,
    twist of a diagnosed record at zero twist of the model (`reefmu.record.with_twist_zero`); no response depends on it.

    Models are equal if all of these are.
    """

    name: str
    lookup: Lookup
    effects: tuple[Effect, ...]
    parameters: tuple[ModelParameter, ...]
    individual: Individual | None = None
    twist_zero: float = 0.0

    def __repr__(self) -> str:
        """One line: the drive, its effects and the torque at the lookup's end."""
        inside = ", ".join(effect.name for effect in self.effects) or "no effects"
        return f"DriveModel({self.name!r}, {inside}, {self.full_torque:.4g} N.m at full twist)"

    def __eq__(self, other: object) -> bool:
        return equal_values(self, other) if isinstance(other, DriveModel) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.name, self.effects, self.parameters, self.full_torque))

    def _repr_html_(self) -> str:
        rows = {"effects": ", ".join(effect.name for effect in self.effects) or "none"}
        rows |= {f"{p.name} [{p.unit}]": f"{p.value:.6g}" for p in self.parameters}
        rows |= {"lacks": self.lacks} if self.lacks else {}
        return html_table(self.name, rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Torque over twist in a slow loop (`torque_loop`), on `ax` or on new axes, which are returned."""
        return view("reefmu.torque_loop:plot_loop")(self, ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` of the slow loop that `plot` draws. Raises `InputError` without pandas."""
        return dataframe(view("reefmu.torque_loop:torque_loop")(self))

    @property
    def drive(self) -> Any:
        """The drive, of any kind, that the lookup was computed from. Raises `InputError` for a lookup of a curve."""
        table = self.lookup.drive_table
        if table is None:
            raise InputError(f"{self.name}: expected a model with a drawing, got one of a curve")
        return drive_from_dict(table)

    @property
    def outputs(self) -> tuple[Signal, ...]:
        """The outputs: `OUTPUTS`, without those of contacts where the model has none."""
        return outputs_of(has_contacts=self.lookup.has_contacts)

    @property
    def lacks(self) -> str:
        """One line on the outputs that this model does not have; empty if it has all."""
        if self.lookup.has_contacts:
            return ""
        names = " and ".join(CONTACT_LOADS)
        return f"{self.name} has no {names}: it is a curve of torque over twist, which states nothing of contacts"

    @property
    def full_torque(self) -> float:
        """Mean torque at the drawing's max_twist, N.m."""
        return self.lookup.full_torque

    @property
    def states(self) -> tuple[Signal, ...]:
        """The states: the last values of the angles that others evolve along, then the effects' own."""
        return state_signals(self.effects)

    @property
    def resets(self) -> NDArray[np.bool_]:
        """Which of `states` restart with every run of a record, (n_states,)."""
        own = [s.resets for e in self.effects for s in e.states]
        return np.array([True] * len(stored_angles(self.effects)) + own, dtype=bool)

    @cached_property
    def _functions(self) -> dict[str, ca.Function]:
        return Composition(self.lookup, self.effects, self.individual).functions()

    @property
    def initial(self) -> ca.Function:
        """(u, p) -> x."""
        return self._functions["initial"]

    @property
    def advance(self) -> ca.Function:
        """(x, u, dt, p) -> x."""
        return self._functions["advance"]

    @property
    def settle(self) -> ca.Function:
        """(x, u, p) -> x."""
        return self._functions["settle"]

    @property
    def rate(self) -> ca.Function:
        """(x, u, p) -> dx/dt."""
        return self._functions["rate"]

    @property
    def output(self) -> ca.Function:
        """(x, u, p) -> y."""
        return self._functions["output"]

    @property
    def jacobian(self) -> ca.Function:
        """(x, u, p) -> dy/du, (n_outputs, n_inputs)."""
        return self._functions["jacobian"]

    def parameter_vector(self) -> NDArray[np.float64]:
        """The values of `parameters`."""
        return np.array([p.value for p in self.parameters])

    def with_parameters(self, values: Mapping[str, float] | None = None, /, **named: float) -> DriveModel:
        """The same model with other parameter values.

        values, named: in SI, by dotted name ("backlash.clearance"); keywords serve "ratio" and "band". Raises
        `UnknownNameError`, or `InputError` for a value outside the parameter's bounds.
        """
        return replace(self, parameters=with_values(self.name, self.parameters, {**(values or {}), **named}))


def build_model(
    drive: DriveLike,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    *,
    lookup: Lookup | None = None,
    n_drives: int = N_DRIVES,
    seed: int = 0,
    executor: Executor | None = None,
    individual: int | None = None,
    inherent: bool = True,
) -> DriveModel:
    """The model of a drive with some effects inside.

    drive: a drive of any kind, its name or the path of a drawing. effects: parameter values by effect and parameter
    name; an empty mapping for an effect that starts neutral. inherent: whether the effects that the drawing itself
    states, such as friction at the crank by `friction_coefficient` or the hysteresis loss of a catalogue gear, are
    inside, with the drawing's values of the parameters that `effects` does not give. lookup: ready tables; else they
    come from the cache, or are built from `n_drives` drives drawn with `seed`, by `executor` if given. individual: the
    seed of one drive of the drawing (`stiffness_model.rotation`), modelled instead of the mean of all.

    Raises `UnknownNameError` for an effect or a parameter that does not exist, `InputError` for a value out of bounds,
    and for an individual or an effect that the drive's kind lacks.
    """
    drive = as_any_drive(drive)
    chosen = chosen_values(inherent_effects(drive) if inherent else {}, effects or {})
    ordered = in_order(chosen)
    for effect in ordered:
        if effect.place in NEED_PARTS:
            expect_has(drive, CONTACT_RESPONSES, effect.name)
    one = None
    if individual is not None:
        expect_has(drive, INDIVIDUALS, "individual")
        one = draw_individual(as_drive(drive, "individual"), individual)
    name = drive.name if one is None else f"{drive.name} individual {one.seed}"
    # Checked before the tables are built, which may take some seconds.
    has_band = one is None and TOLERANCES not in kind_of(drive).lacks
    parameters = model_parameters(name, drive.ratio, ordered, chosen, has_band=has_band)
    table = lookup if lookup is not None else cached_lookup(drive, n_drives, seed, executor)
    return DriveModel(name, with_contact_tables(table, drive, ordered), ordered, parameters, one)


def build_curve_model(
    table: CurveLookup,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    *,
    assumed_ratio: float | None = None,
) -> DriveModel:
    """The model of a curve (`stiffness_model.lookup.curve_lookup`) with some effects inside.

    assumed_ratio: for simulations of a curve whose ratio is unknown, because the crank was locked; it is not saved.
    Raises the errors of `build_model`, and `InputError` for effects that need a drawing and for an unknown ratio.
    """
    chosen = dict(effects or {})
    ordered = in_order(chosen)
    name = table.curve["name"]
    for effect in ordered:
        if effect.place in NEED_PARTS:
            raise InputError(f"{name}: expected effects that do without a drawing, got {effect.name}")
    ratio = table.curve.get("ratio", assumed_ratio)
    if ratio is None:
        raise InputError(f"{name}: expected a curve with its ratio, crank to output with its sign, got none")
    return DriveModel(name, table, ordered, model_parameters(name, ratio, ordered, chosen, has_band=False))


def describe_effects(model: DriveModel) -> dict[str, dict[str, Any]]:
    """Parameter values of the effects inside, by effect and parameter name."""
    values = {p.name: p.value for p in model.parameters}
    return {e.name: {p.name: values[f"{e.name}.{p.name}"] for p in e.parameters} for e in model.effects}
