"""Derivatives are exact; the generated C compiles and gives the same numbers."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from reefmu.effects import EFFECTS
from reefmu.model.drive_model import DriveModel
from reefmu.simulate import simulate_signal

from .conftest import Build, Trajectory

FUNCTIONS = ("initial", "advance", "rate", "output", "jacobian")
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@pytest.fixture(scope="module")
def with_all_effects(build: Build, typical) -> DriveModel:
    return build(typical)


@pytest.fixture(scope="module")
def arguments(with_all_effects: DriveModel, trajectory: Trajectory) -> dict[str, list[np.ndarray]]:
    """Arguments of every function at points of the trajectory."""
    states = simulate_signal(with_all_effects, trajectory.time, trajectory.inputs).states
    x, u, p = states[150], trajectory.inputs[151], with_all_effects.parameter_vector()
    return {
        "initial": [u, p],
        "advance": [x, u, np.array([0.05]), p],
        "rate": [x, u, p],
        "output": [x, u, p],
        "jacobian": [x, u, p],
    }


def assert_derivatives(
    exact: np.ndarray, function: ca.Function, arguments: list[np.ndarray], which: int, steps: np.ndarray
) -> None:
    """Compares derivatives by one argument with central differences."""
    columns = []
    value = np.abs(np.array(function(*arguments))).reshape(-1, 1)
    for k, step in enumerate(steps):
        change = np.zeros(len(steps))
        change[k] = step
        up, down = (
            np.array(function(*[a + sign * change if i == which else a for i, a in enumerate(arguments)])).ravel()
            for sign in (1, -1)
        )
        columns.append((up - down) / (2 * step))
    rounding = 1e-15 * (value + 1e-6) / steps
    expected = np.stack(columns, axis=1)
    assert (np.abs(exact - expected) <= 2e-5 * np.abs(expected).max(axis=0, keepdims=True) + rounding).all()


def test_jacobian_by_inputs(with_all_effects: DriveModel, arguments) -> None:
    steps = np.array([1e-6, 1e-4, 1e-8, 1e-5, 1e-3])
    exact = np.array(with_all_effects.jacobian(*arguments["jacobian"]))
    assert_derivatives(exact, with_all_effects.output, arguments["output"], 1, steps)


@pytest.mark.parametrize("name", ["output", "advance"])
def test_sensitivities_by_parameters(name: str, with_all_effects: DriveModel, arguments) -> None:
    function = getattr(with_all_effects, name)
    p = arguments[name][-1]
    symbols = [ca.MX.sym(f"a{k}", len(a)) for k, a in enumerate(arguments[name])]
    slopes = ca.Function("slopes", symbols, [ca.jacobian(function(*symbols), symbols[-1])])
    exact = np.array(slopes(*arguments[name]))
    steps = 1e-5 * np.array([q.nominal for q in with_all_effects.parameters])
    assert len(p) == len(steps)
    assert_derivatives(exact, function, arguments[name], len(symbols) - 1, steps)


@pytest.mark.slow
@pytest.mark.skipif(COMPILER is None, reason="no C compiler on the PATH")
@pytest.mark.parametrize("effects", [[], list(EFFECTS)], ids=["plain", "with_all_effects"])
def test_generated_c_gives_the_same_numbers(
    effects: list[str], build: Build, typical, trajectory: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = build({name: typical[name] for name in effects})
    monkeypatch.chdir(tmp_path)  # CasADi writes to the working folder
    generator = ca.CodeGenerator("model.c", {"verbose_runtime": False})
    for name in FUNCTIONS:
        generator.add(getattr(model, name))
    generator.generate()
    library = tmp_path / f"model_{len(effects)}.so"
    subprocess.run([str(COMPILER), "-O1", "-shared", "-fPIC", "-o", str(library), "model.c", "-lm"], check=True)
    states = simulate_signal(model, trajectory.time, trajectory.inputs).states
    p = model.parameter_vector()
    for k in (3, 120, 399):
        x, u = states[k - 1], trajectory.inputs[k]
        given = {"initial": [u, p], "advance": [x, u, 0.05, p]}
        for name in FUNCTIONS:
            values = given.get(name, [x, u, p])
            compiled = ca.external(name, str(library))
            assert np.array(compiled(*values)) == pytest.approx(np.array(getattr(model, name)(*values)), rel=1e-12)
