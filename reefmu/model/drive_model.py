"""The drive model: the contact lookup plus effects in their places, as CasADi functions.

This is the one truth. Simulation, FMUs, generated C and python-control all evaluate these functions:

    initial(u, p) -> x              states that fit the first inputs
    advance(x, u, dt, p) -> x       exact state update; inputs held over dt
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
from typing import TYPE_CHECKING, Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from stiffness_model.display import dataframe, html_table
from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError, expect_number, unknown_name
from stiffness_model.io.drawing_toml import DriveLike, as_drive, drive_from_dict
from stiffness_model.lookup.build_lookup import N_DRIVES, Lookup
from stiffness_model.rotation import Individual, draw_individual

from ..effects import Effect, Place, find_effect
from .contacts.curve_table import source_curve
from .contacts.element import with_contact_tables
from .contacts.tables import cached_lookup
from .stages.composition import Composition
from .stages.expressions import INPUT_NAMES, OUTPUT_NAMES
from .stages.order import stored_angles

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Signal(NamedTuple):
    """One input, output or state: unit, meaning, start value, bounds for a tool's dialogue and typical size.

    discrete: an output that jumps from one value to another.
    """

    name: str
    unit: str
    description: str
    start: float = 0.0
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    discrete: bool = False


class ModelParameter(NamedTuple):
    """One parameter of an assembled model."""

    name: str
    value: float
    minimum: float | None
    maximum: float | None
    unit: str
    description: str
    tunable: bool
    nominal: float


INPUTS = (
    Signal("crank.phi", "rad", "Angle of the crank"),
    Signal("crank.w", "rad/s", "Speed of the crank; used by rate-dependent effects only"),
    Signal("output.phi", "rad", "Angle of the output"),
    Signal("output.w", "rad/s", "Speed of the output; used by rate-dependent effects only"),
    Signal("temperature", "degC", "Temperature of the drive", 20.0, -273.15, 1000.0, 20.0),
)
OUTPUTS = (
    Signal("output.tau", "N.m", "Torque that the drive exerts on the output"),
    Signal("crank.tau", "N.m", "Torque that the drive exerts on the crank"),
    Signal("twist", "rad", "crank.phi/ratio - output.phi"),
    Signal(
        "stiffness",
        "N.m/rad",
        "Derivative of output.tau by the twist of the contacts; states, speeds and place of "
        "the elements held: without what friction adds while it turns over",
        minimum=0.0,
    ),
    Signal("max_contact_force", "N", "Greatest contact force on a rolling element, mean over drives", minimum=0.0),
    Signal("load_share", "1", "Greatest torque of one rolling element over the drive's", minimum=0.0),
    Signal(
        "in_range",
        "1",
        "1 inside the lookup's range, 0 where it is continued by its last slope",
        1.0,
        0.0,
        1.0,
        discrete=True,
    ),
    Signal("measured.tau", "N.m", "output.tau as the rig's torque sensor reads it"),
)
assert tuple(s.name for s in INPUTS) == INPUT_NAMES
assert tuple(s.name for s in OUTPUTS) == OUTPUT_NAMES


@dataclass(frozen=True)
class DriveModel:
    """A drive as a component: its lookup, the effects inside and their parameters.

    parameters: "ratio", "band", then "<effect>.<parameter>". Its vector p, like u, x and y, is in the order of
    `parameters`, `INPUTS`, `states` and `OUTPUTS`. individual: one drive with its own parts, whose torque changes
    as it turns, instead of the mean of all; its lookup then gives the range and the drawing.
    """

    name: str
    lookup: Lookup
    effects: tuple[Effect, ...]
    parameters: tuple[ModelParameter, ...]
    individual: Individual | None = None

    def __repr__(self) -> str:
        """One line: the drive, its effects and the torque at the lookup's end."""
        inside = ", ".join(effect.name for effect in self.effects) or "no effects"
        return f"DriveModel({self.name!r}, {inside}, {self.full_torque:.4g} N.m at full twist)"

    def _repr_html_(self) -> str:
        rows = {"effects": ", ".join(effect.name for effect in self.effects) or "none"}
        rows |= {f"{p.name} [{p.unit}]": f"{p.value:.6g}" for p in self.parameters}
        return html_table(self.name, rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Torque over twist in a slow loop (`torque_loop`), on `ax` or on new axes, which are returned."""
        from ..torque_loop import plot_loop

        return plot_loop(self, ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` of the slow loop that `plot` draws. Raises `InputError` without pandas."""
        from ..torque_loop import torque_loop

        return dataframe(torque_loop(self))

    @property
    def drive(self) -> Drive:
        """The drawing behind the lookup. Raises `InputError` where a curve lies behind it."""
        if source_curve(self.lookup) is not None:
            raise InputError(f"{self.name}: expected a model with a drawing, got one of a curve")
        return drive_from_dict(self.lookup.drawing)

    @property
    def full_torque(self) -> float:
        """Mean torque at the drawing's max_twist, N.m."""
        return self.lookup.full_torque

    @property
    def states(self) -> tuple[Signal, ...]:
        """The states: what is remembered of the last inputs, then the effects' own."""
        memory = tuple(
            Signal(
                f"last.{path.value}",
                "rad",
                f"{path.value.capitalize()} angle at the last step"
                if path.value != "twist"
                else "Twist at the last step",
            )
            for path in stored_angles(self.effects)
        )
        own = tuple(Signal(f"{e.name}.{s.name}", s.unit, s.description) for e in self.effects for s in e.states)
        return memory + own

    @property
    def resets(self) -> NDArray[np.bool_]:
        """Which of `states` every run of a record starts anew, (n_states,)."""
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
        """The same model with other parameter values, by dotted name.

        Raises `UnknownNameError`, or `InputError` for a value outside the parameter's bounds.
        """
        return replace(self, parameters=_with_values(self.name, self.parameters, {**(values or {}), **named}))


def build_model(
    drive: DriveLike,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    *,
    lookup: Lookup | None = None,
    n_drives: int = N_DRIVES,
    seed: int = 0,
    executor: Executor | None = None,
    individual: int | None = None,
) -> DriveModel:
    """The model of a drawing with some effects inside; drive: itself, a preset's name or a drawing's path.

    effects: parameter values by effect and parameter name; an empty mapping for an effect that starts neutral.
    lookup: ready tables; else they come from the cache or are built. individual: the seed of one drive of the
    drawing (`stiffness_model.rotation`), to be modelled instead of the mean of all.

    Raises `UnknownNameError` or `InputError` for effects and values that do not exist or are out of bounds.
    """
    drive = as_drive(drive)
    chosen = dict(effects or {})
    ordered = _in_order(chosen)
    one = None if individual is None else draw_individual(drive, individual)
    name = drive.name if one is None else f"{drive.name} individual {one.seed}"
    # Before the tables, which may take some seconds: a wrong value is told at once.
    parameters = _parameters(name, drive.ratio, ordered, chosen, _band() if one is None else _no_band())
    table = lookup if lookup is not None else cached_lookup(drive, n_drives, seed, executor)
    return DriveModel(name, with_contact_tables(table, drive, ordered), ordered, parameters, one)


def build_curve_model(table: Lookup, effects: Mapping[str, Mapping[str, float]] | None = None) -> DriveModel:
    """The model of a curve (`curve_table.curve_lookup`) with some effects inside.

    Raises `UnknownNameError` or `InputError` as `build_model`, and for effects that need a drawing.
    """
    chosen = dict(effects or {})
    ordered = _in_order(chosen)
    curve = source_curve(table)
    assert curve is not None
    for effect in ordered:
        if effect.place in (Place.MODULUS, Place.ELEMENT):
            raise InputError(f"{curve['name']}: expected effects that do without a drawing, got {effect.name}")
    parameters = _parameters(curve["name"], curve["ratio"], ordered, chosen, _band())
    return DriveModel(curve["name"], table, ordered, parameters)


def _in_order(names: Mapping[str, Any]) -> tuple[Effect, ...]:
    places = list(Place)
    return tuple(sorted((find_effect(name) for name in names), key=lambda e: (places.index(e.place), e.name)))


def _parameters(
    name: str,
    ratio: float,
    ordered: tuple[Effect, ...],
    chosen: Mapping[str, Mapping[str, float]],
    band: ModelParameter,
) -> tuple[ModelParameter, ...]:
    """Ratio, band and the effects' parameters, with the chosen values; `name` is the model's, for errors."""
    parameters = (
        ModelParameter(
            "ratio", ratio, None, None, "1", "Transmission ratio, crank to output, signed", False, abs(ratio)
        ),
        band,
        *(
            ModelParameter(
                f"{e.name}.{p.name}", p.neutral, p.minimum, p.maximum, p.unit, p.description, True, p.nominal
            )
            for e in ordered
            for p in e.parameters
        ),
    )
    return _with_values(name, parameters, {f"{e}.{p}": v for e, values in chosen.items() for p, v in values.items()})


def _with_values(
    where: str, parameters: tuple[ModelParameter, ...], wanted: Mapping[str, float]
) -> tuple[ModelParameter, ...]:
    """Parameters with other values, each checked against its bounds."""
    known = {p.name: p for p in parameters}
    for name, value in wanted.items():
        if name not in known:
            raise unknown_name("parameter", name, known, where)
        p = known[name]
        number = expect_number(value, f"a finite number in {p.unit}", f"{where}: {name}")
        if not p.tunable and number != p.value:
            raise unknown_name("tunable parameter", name, [q.name for q in parameters if q.tunable], where)
        low, high = -np.inf if p.minimum is None else p.minimum, np.inf if p.maximum is None else p.maximum
        expect_number(
            number,
            f"a value within {low:g} ... {high:g} {p.unit}",
            f"{where}: {name}",
            low=np.nextafter(low, -np.inf),
            high=np.nextafter(high, np.inf),
        )
    return tuple(p._replace(value=float(wanted.get(p.name, p.value))) for p in parameters)


def _band() -> ModelParameter:
    return ModelParameter(
        "band",
        0.0,
        -1.0,
        1.0,
        "1",
        "Place in the population: 0 mean, -1 the 10th, +1 the 90th percentile of the torque",
        True,
        1.0,
    )


def _no_band() -> ModelParameter:
    return ModelParameter("band", 0.0, 0.0, 0.0, "1", "Has no meaning for an individual drive", False, 1.0)


def describe_effects(model: DriveModel) -> dict[str, dict[str, Any]]:
    """Parameter values of the effects inside, by effect and parameter name."""
    values = {p.name: p.value for p in model.parameters}
    return {e.name: {p.name: values[f"{e.name}.{p.name}"] for p in e.parameters} for e in model.effects}
