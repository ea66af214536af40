"""An FMU as a discrete-time block of python-control, and the inertias to connect it with.

python-control expects a block to be a pair of pure functions of its state: it may call them more than once per sample,
or start again from an earlier state. The state of an FMU is internal. The block's only state is therefore the number of
a snapshot of the FMU state: the update function restores that snapshot if the FMU is in another state, steps, and takes
a new snapshot. The same state and input always give the same next state.

Hence only states that the block has returned exist, and 0, the initialised FMU. Linearisation by differences
(`reefmu.joint.linearize` gives the model's exact one) and the search for an operating point are not possible.

The outputs at a sample follow from the inputs of the sample before, since FMI 2.0 gives outputs only after a step. The
block has no direct feedthrough, loops around it are not algebraic, and they have the delay described in `cosimulation`.
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Self

import control as ct
import numpy as np

from reefmu.fmu.importer.instance import FmuDrive
from reefmu.model.masses import STATES, Masses
from stiffness_model.errors import InputError, expect_number, unknown_name
from stiffness_model.numerics.arrays import Array

from .cosimulation import COUPLING_OUTPUTS, extrapolate
from .named_system import NamedSystem
from .systems import python_name, python_names


@dataclass
class _Snapshot:
    state: bytes
    outputs: Array
    successors: dict[bytes, int] = field(default_factory=dict)
    """Numbers of the snapshots after a step, by input."""


class FmuBlock(NamedSystem):
    """A discrete-time system whose update steps an FMU; `fmu_block` makes it.

    `close`, or the end of a `with` block, frees the FMU instance.
    """

    def __init__(self, fmu: FmuDrive, step: float, initial: Mapping[str, float], snapshots: int, name: str) -> None:
        self._fmu, self._inputs, self._step = fmu, fmu.inputs, step
        outputs = np.array(list(fmu.initialize(initial).values()))
        self._snapshots = {0: _Snapshot(fmu.save(), outputs)}
        self._current, self._newest, self._max_snapshots = 0, 0, snapshots
        self._free = weakref.finalize(self, fmu.close)
        super().__init__(
            self._update,
            self._output,
            inputs=python_names(fmu.inputs),
            outputs=python_names(fmu.outputs),
            states=["snapshot"],
            dt=step,
            name=name,
        )

    def close(self) -> None:
        """Free the FMU instance; without this call it is freed with the block. Further calls have no effect."""
        self._free()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _find(self, x: Array) -> tuple[int, _Snapshot]:
        number = int(x[0]) if np.isfinite(x[0]) else -1
        if number != x[0] or number not in self._snapshots:
            raise InputError(
                f"{self.name}: expected the state 0 or one that the block returned within its last "
                f"{self._max_snapshots} steps, got {float(x[0]):g}; an FMU cannot be put into others"
            )
        return number, self._snapshots[number]

    def _output(self, _t: float, x: Array, _u: Array, _params: Mapping[str, Any]) -> Array:
        return self._find(x)[1].outputs

    def _update(self, _t: float, x: Array, u: Array, _params: Mapping[str, Any]) -> Array:
        number, snapshot = self._find(x)
        values = np.asarray(u, float)
        successor = snapshot.successors.get(values.tobytes())
        if successor not in self._snapshots:
            if self._current != number:
                self._fmu.restore(snapshot.state)
            self._current = -1  # unknown until the step has succeeded
            outputs = self._fmu.step(self._step, dict(zip(self._inputs, values.tolist(), strict=True)))
            successor = self._current = self._newest = self._newest + 1
            self._snapshots[successor] = _Snapshot(self._fmu.save(), np.array(list(outputs.values())))
            snapshot.successors[values.tobytes()] = successor
            self._snapshots.pop(successor - self._max_snapshots if successor > self._max_snapshots else -1, None)
        return np.array([float(successor)])


def fmu_block(
    path: str | os.PathLike[str],
    step: float,
    *,
    parameters: Mapping[str, float] | None = None,
    initial: Mapping[str, float] | None = None,
    snapshots: int = 10_000,
    name: str = "drive",
) -> FmuBlock:
    """An exported FMU as a discrete-time system with sampling time `step`, s.

    Inputs and outputs are the FMU's, with `crank.phi` called `crank_phi`. parameters: the FMU's, by its own names.
    initial: inputs at time 0, by its own names; others keep their start values. snapshots: number of earlier states
    to which the block can return, about 1 kB each. name: of the system.

    Raises `InputError` for an FMU that does not run on this platform or cannot save its state.
    """
    expect_number(step, "a positive sampling time, s", "step", low=0.0)
    expect_number(snapshots, "at least one snapshot to keep", "snapshots", low=0)
    fmu = FmuDrive(path, parameters=parameters, name=python_name(name))
    try:
        return FmuBlock(fmu, step, initial or {}, int(snapshots), name)
    except BaseException:
        fmu.close()
        raise


def masses_block(
    masses: Masses,
    step: float,
    ratio: float,
    *,
    name: str = "masses",
    scheme: Literal["parallel", "extrapolated"] = "extrapolated",
) -> ct.NonlinearIOSystem:
    """Motor and load as a discrete-time system that `ct.interconnect` connects to `fmu_block` by the signals' names.

    Inputs motor_tau, load_tau, crank_tau, output_tau, twist, stiffness; outputs and states crank_phi, crank_w,
    output_phi, output_w. step: sampling time, s; ratio: of the drive, signed. scheme: as in `cosimulate`, which gives
    the same motion; "parallel" does not use twist and stiffness. Raises `InputError`, also for another scheme.
    """
    if scheme not in ("parallel", "extrapolated"):
        raise unknown_name("scheme", scheme, ("parallel", "extrapolated"), "masses_block")
    expect_number(step, "a positive sampling time, s", "step", low=0.0)

    def update(_t: float, x: Array, u: Array, _params: Mapping[str, Any]) -> Array:
        outputs = u[2:] if scheme == "extrapolated" else np.array([u[2], u[3], 0.0, 0.0])
        return extrapolate(masses, ratio, step, x, u[:2], outputs)

    inputs = python_names(("motor.tau", "load.tau", *COUPLING_OUTPUTS))
    return NamedSystem(
        update,
        lambda t, x, u, params: x[:4],
        inputs=inputs,
        outputs=python_names(STATES),
        states=python_names(STATES),
        dt=step,
        name=name,
    )
