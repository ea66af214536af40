"""The C host that replays an excitation (host/replay.c), and the same cycles with the Python model."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from reefmu.fmu.model.component import Component
from reefmu.fmu.model.declaration import declare_with_derivatives
from reefmu.fmu.validation.reference_run import Excitation
from stiffness_model.numerics.arrays import Array

SOURCE = Path(__file__).parent / "host" / "replay.c"
HEADERS = Path(__import__("reefmu").__file__).parent / "fmu" / "native" / "fmi2"


def build_replay(target: Path, compiler: Sequence[str] = ("gcc",), libraries: Sequence[str] = ("-ldl",)) -> Path:
    """Compile the host; returns the program `target`."""
    subprocess.run(
        [*compiler, "-w", "-O1", "-std=gnu99", "-I", str(HEADERS), "-o", str(target), str(SOURCE), *libraries],
        check=True,
    )
    return target


def replay(
    command: Sequence[str],
    library: Path | str,
    guid: str,
    component: Component,
    excitation: Excitation,
    folder: Path,
    *,
    rounds: int = 1,
) -> Array:
    """Outputs and states, shape (n, n_outputs + n_states): after every step of a single cycle, else after every cycle.

    command: runs the host. Row 0 is the result of the initialisation. rounds: number of cycles.
    """
    interface = declare_with_derivatives(component)
    references = [v.reference for v in (*interface.block("output"), *interface.block("local"))]
    rows = np.column_stack([np.concatenate([[0.0], excitation.dt]), excitation.inputs])
    head = np.array([len(component.inputs), len(rows), len(references), float(rounds == 1), *references])
    np.concatenate([head, rows.ravel()]).tofile(folder / "signal.bin")
    done = subprocess.run(
        [*command, str(library), guid, "signal.bin", "result.bin", str(rounds)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"status {done.returncode}: {done.stderr[-1000:]}"
    return np.fromfile(folder / "result.bin").reshape(-1, len(references))


def repeat_model(component: Component, excitation: Excitation, parameters: Array, rounds: int) -> Array:
    """The same for the Python model, whose states continue from cycle to cycle."""
    n, p = len(excitation.dt), np.tile(parameters[:, None], len(excitation.dt))
    x, u, dt, q = (
        ca.MX.sym(name, size)
        for name, size in (
            ("x", len(component.states)),
            ("u", len(component.inputs)),
            ("dt", 1),
            ("p", len(parameters)),
        )
    )
    one = ca.Function("one", [x, u, dt, q], [component.advance(x, u, dt, q)])
    whole = one.mapaccum("round", n, [0], [0], {"base": 10})
    u, dt, last = excitation.inputs[1:].T, excitation.dt[None, :], excitation.inputs[-1]
    x = np.array(component.initial(excitation.inputs[0], parameters)).ravel()

    def row(inputs: Array) -> Array:
        return np.concatenate([np.array(component.output(x, inputs, parameters)).ravel(), x])

    rows = [row(excitation.inputs[0])]
    for _ in range(rounds):
        x = np.array(whole(x, u, dt, p))[:, -1]
        rows.append(row(last))
    return np.array(rows)
