"""python-control systems of the drive and the joint, with exact linearisation.

python-control allows no dots in the names of signals: `crank.phi` becomes `crank_phi`. Parameters have the name of the
system in front of the model's dotted names, which distinguishes them in an interconnection:
`ct.input_output_response(loop, t, u, params={"left.band": 1.0, "right.load.inertia": 3.0})`. A system by itself
also accepts them without the prefix: `ct.linearize(system, x, u, params={"band": 1.0})`. See `named_system`.

`ct.input_output_response` may miss a short input unless a maximum step is set (python-control issue 1152): pass
solve_ivp_kwargs={"max_step": ...}.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from reefmu.model.buffered import Buffered
from reefmu.model.drive_model import DriveModel
from stiffness_model.errors import InputError, expect
from stiffness_model.numerics.arrays import Array

from .equations import JointModel, SystemEquations, drive_equations
from .named_system import NamedSystem


def drive_system(model: DriveModel, *, name: str | None = None) -> ct.NonlinearIOSystem:
    """The drive alone, continuous in time.

    Inputs and outputs as in `reefmu.model`'s `INPUTS` and `OUTPUTS`, with their units and signs; states those of the
    effects.
    """
    return _CasadiSystem(drive_equations(model), name or python_name(model.name))


def joint_system(joint: JointModel, *, name: str | None = None) -> ct.NonlinearIOSystem:
    """Motor, drive and load, continuous in time, as a python-control system.

    name: of the system; by default that of the drive with "_joint". Inputs motor_tau, load_tau, N.m; outputs as the
    joint's FMU, crank_phi, crank_w, output_phi, output_w, rad and rad/s, and those of the drive; states the first four
    of these, then the effects'. `JointModel.equilibrium` gives initial states.
    """
    return _CasadiSystem(joint.equations, name or f"{python_name(joint.drive.name)}_joint")


def linearize(
    system: JointModel | DriveModel, x: ArrayLike, u: ArrayLike, params: Mapping[str, float] | None = None
) -> ct.StateSpace:
    """The linear system at a state and an input, exact by CasADi; signals as in `drive_system` and `joint_system`.

    system: a joint or a drive model. x: state (n_states,), SI units (rad, rad/s, then those of the effects); u: input
    (n_inputs,), SI units (N.m for a joint; rad, rad/s and degC for a drive); `JointModel.equilibrium` gives both.
    params: values of parameters by name, SI units, which replace those of the system.
    """
    made = joint_system(system) if isinstance(system, JointModel) else drive_system(system)
    return made.linearize(x, u, params=params, copy_names=True)


def python_name(name: str) -> str:
    """The name of a signal or a system in python-control.

    >>> python_name("crank.phi")
    'crank_phi'
    """
    return "".join(c if c.isalnum() or c in "_[]" else "_" for c in name)


def python_names(names: Sequence[str]) -> list[str]:
    """`python_name` of each."""
    return [python_name(name) for name in names]


class _CasadiSystem(NamedSystem):
    """A python-control system of `SystemEquations` with an exact `linearize`."""

    def __init__(self, equations: SystemEquations, name: str) -> None:
        self.equations = equations
        self._fast_rate, self._fast_output = Buffered(equations.rate), Buffered(equations.output)
        super().__init__(
            self._rate,
            self._output,
            inputs=python_names(equations.inputs),
            outputs=python_names(equations.outputs),
            states=python_names(equations.states),
            params=equations.parameters,
            name=name,
        )
        self._update_params(None)

    def _update_params(self, params: Mapping[str, Any] | None) -> None:
        super()._update_params(params)
        self._p = np.array(list(self._current_params.values()))

    def _vector(self, params: Mapping[str, Any]) -> Array:
        # During a simulation they are constant.
        return self._p if params is self._current_params else np.array(list(self.params.updated_with(params).values()))

    def _rate(self, _t: float, x: Array, u: Array, params: Mapping[str, Any]) -> Array:
        return self._fast_rate(x, u, self._vector(params))

    def _output(self, _t: float, x: Array, u: Array, params: Mapping[str, Any]) -> Array:
        return self._fast_output(x, u, self._vector(params))

    def linearize(
        self,
        x0: Any,
        u0: Any = None,
        t: float = 0.0,
        params: Mapping[str, float] | None = None,
        eps: float | None = None,
        copy_names: bool = False,
        **kwargs: Any,
    ) -> ct.StateSpace:
        """The exact `ct.StateSpace` at a point; `eps`, the step of python-control's differences, is refused."""
        if isinstance(x0, ct.OperatingPoint):
            x0, u0 = x0.states, x0.inputs if u0 is None else u0
        if eps is not None:
            raise InputError(f"{self.name}: expected no eps, since the linearisation is exact, got {eps!r}")
        x = self._point(x0, len(self.equations.states), "states")
        u = self._point(0.0 if u0 is None else u0, len(self.equations.inputs), "inputs")
        a, b, c, d = self.equations.linear(x, u, self._vector(params or {}))
        names: dict[str, Any] = {
            "inputs": self.input_labels,
            "outputs": self.output_labels,
            "states": self.state_labels,
        }
        if copy_names:
            names["name"] = f"{self.name}$linearized"
        return ct.StateSpace(a, b, c, d, remove_useless_states=False, **(names | kwargs))

    def _point(self, given: Any, size: int, what: str) -> Array:
        values = np.asarray(given, float)
        if values.ndim == 0:  # as in python-control, one number for all
            values = np.full(size, float(values))
        expect(values.shape == (size,) and bool(np.isfinite(values).all()), f"{size} finite {what}", given, self.name)
        return values
