"""A record of several runs through an FMU, compared with the Python model."""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.replay import replay_record
from reefmu.fmu.importer.saved_values import replace_values
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.record import Record, make_record
from reefmu.simulate import simulate_record
from stiffness_model.errors import InputError
from stiffness_model.lookup.build_lookup import Lookup

pytestmark = pytest.mark.slow

COMPILED = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler on the PATH")
EFFECTS = {
    "fresh": {"hysteresis": {"torque": 3.0, "presliding": 5e-5}, "creep": {"compliance": 1e-6, "time": 0.5}},
    "lasting": {"wear": {"rate": 1e-7}, "torque_sensor_drift": {"rate": 0.1}},
}
EFFECTS["both"] = EFFECTS["fresh"] | EFFECTS["lasting"]
OUTPUTS = ("measured.tau", "output.tau", "stiffness", "max_contact_force")


@pytest.fixture(scope="module", params=sorted(EFFECTS))
def inside(request: pytest.FixtureRequest, drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, EFFECTS[request.param], lookup=lookup)


@pytest.fixture(
    scope="module",
    params=[("python", "2.0"), *(pytest.param(("native", fmi), marks=COMPILED) for fmi in ("2.0", "3.0"))],
    ids=" ".join,
)
def fmu(request: pytest.FixtureRequest, inside: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("replay") / "drive.fmu"
    backend, fmi = request.param
    return export_fmu(inside, path, backend=backend, fmi=fmi)


def record_of(clocks: list[np.ndarray]) -> Record:
    """Runs with rising twist and a turning crank, at different loads and angles."""
    parts = []
    for run, time in enumerate(clocks):
        way = np.linspace(0.0, 1.0, len(time))
        twist = (1 + 0.3 * run) * 1e-3 * np.sin(7 * way + run)
        output = 0.3 * run + 0.5 * way
        parts.append(
            {
                "time": time,
                "run": np.full(len(time), run),
                "crank_angle": -29 * (twist + output),
                "output_angle": output,
                "output_torque": np.zeros(len(time)),
            }
        )
    return make_record({name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


@pytest.mark.parametrize(
    ("pause", "repeat"),
    [(None, False), (None, True), (2.0, False), (0.0, False)],
    ids=["the clock starts anew", "the clock stands still", "a pause", "no pause"],
)
def test_runs_as_the_model(fmu: Path, inside: DriveModel, pause: float | None, repeat: bool) -> None:
    clock = 0.01 * np.arange(60.0)
    if repeat:
        clock = np.repeat(clock[:30], 2)
    starts = [0.0, 0.0, 0.0] if pause is None else list(itertools.accumulate(3 * [clock[-1] + pause], initial=0.0))[:3]
    record = record_of([start + clock for start in starts])
    expected, found = simulate_record(inside, record), replay_record(fmu, record, OUTPUTS)
    for name in OUTPUTS:
        scale = np.abs(expected[name]).max()
        assert found[name] == pytest.approx(expected[name], abs=1e-9 * scale), name


def test_a_state_without_the_values_is_refused() -> None:
    with pytest.raises(InputError, match="found them 0 times"):
        replace_values(b"opaque", [1.0, 2.0], {0: 3.0})
