"""An FMU as a discrete-time block of python-control, and the masses to connect it with.

python-control takes a block for a pair of pure functions of its state: it may call them more than once per sample,
or start over from an earlier state. An FMU keeps its state to itself. So the block's one state is the number of a
snapshot: its update function restores that snapshot where the FMU stands elsewhere, steps, and takes a new one. The
same state and input always give the same next state.

What that means: only states that the block itself has returned exist, and 0, the FMU just initialised. There is no
linearisation by differences (`reefmu.joint.linearize` has the model's), and no search for an operating point.

The block's outputs at a sample answer the inputs of the sample before: FMI 2.0 shows outputs only after a step. So it
has no direct feedthrough, loops around it are no algebraic loops, and they carry the lag of `cosimulation`.
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
from .parameters import NamedSystem
from .systems import python_name, python_names


@dataclass
class _Snapshot:
    state: bytes
    outputs: Array
    successors: dict[bytes, int] = field(default_factory=dict)
    """Numbers of the snapshots that follow, by input."""


class FmuBlock(NamedSystem):
    """A discrete-time system whose update steps an FMU; made by `fmu_block`.

    `close`, or leaving a `with` block, frees the FMU.
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
        """Free the FMU. May be called again; else it is freed with the block."""
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
            self._current = -1  # until the step has gone well, the FMU stands nowhere known
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
    initial: inputs at time 0, by its own names; others keep their start value. snapshots: how many snapshots are kept
    to go back to, about 1 kB each.
    Errors: `InputError` for an FMU that does not run here or cannot save its state.
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
    """Motor and load as a discrete-time system that `ct.interconnect` joins to `fmu_block` by the signals' names.

    Inputs motor_tau, load_tau, crank_tau, output_tau, twist, stiffness; outputs and states crank_phi, crank_w,
    output_phi, output_w. ratio: the drive's, signed. scheme: as in `cosimulate`, whose motion the pair repeats;
    "parallel" leaves twist and stiffness unused.
    """
    if scheme not in ("parallel", "extrapolated"):
        raise unknown_name("scheme", scheme, ("parallel", "extrapolated"), "masses_block")
    expect_number(step, "a positive sampling time, s", "step", low=0.0)

    def update(_t: float, x: Array, u: Array, _params: Mapping[str, Any]) -> Array:
        answer = u[2:] if scheme == "extrapolated" else np.array([u[2], u[3], 0.0, 0.0])
        return extrapolate(masses, ratio, step, x, u[:2], answer)

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
