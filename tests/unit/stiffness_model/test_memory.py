"""Work that exceeds the available memory is refused beforehand, by a realistic estimate."""

from __future__ import annotations

import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model import memory
from stiffness_model.drawing import sampling
from stiffness_model.errors import InputError
from stiffness_model.montecarlo import population
from stiffness_model.montecarlo.population import memory_needed
from stiffness_model.ratings.static_safety import static_safety


def test_ten_million_drives_beyond_the_address_space_are_refused_in_one_line(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource", reason="this system has no limits of resources")
    limit = 1_500_000_000
    done = subprocess.run(
        [sys.executable, "-m", "reefmu", "curve", "drive_1", "--drives", "10000000", "--out", str(tmp_path / "c")],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1
    assert "10000000 virtual drives at 61 twists" in done.stderr
    assert "got an estimate of 73.1 GB; take fewer drives" in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the address space in use is read from /proc")
def test_the_remaining_address_space_limits_the_available_memory() -> None:
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2**31, 2**31)); "
        "from stiffness_model.memory import available; a = available(); b = bytearray(200_000_000); "
        "print(a, a - available())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    )
    left, taken = (float(text) for text in done.stdout.split())
    assert 0 < left < 2**31
    assert taken == pytest.approx(200e6, rel=0.05)


def test_free_memory_and_control_group_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "meminfo").write_text("MemTotal: 9000 kB\nMemFree: 100 kB\nMemAvailable:    4000 kB\n")
    monkeypatch.setattr(memory, "_PROC", tmp_path)
    monkeypatch.setattr(memory, "_GROUP", tmp_path)
    assert memory.available() <= 4000 * 1024
    (tmp_path / "memory.max").write_text("max\n")
    (tmp_path / "memory.current").write_text("5\n")
    assert memory._control_group() == float("inf")  # pyright: ignore[reportPrivateUsage]
    (tmp_path / "memory.max").write_text("1000000\n")
    (tmp_path / "memory.current").write_text("300000\n")
    assert memory.available() == 700_000
    for name in ("meminfo", "memory.max"):
        (tmp_path / name).unlink()
    assert memory.available() > 0, "where the system states nothing, nothing is refused"


def test_no_deviations_are_drawn_before_the_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    drive = sm.load_drive("drive_1", bearing_capacity="40 kN")
    monkeypatch.setattr(memory, "available", lambda: 1e6)
    monkeypatch.setattr(sampling, "draw", lambda *_: pytest.fail("drawn"))
    for ask in (lambda: sm.simulate(drive, [0.001], 20_000), lambda: static_safety(drive, [0.001], 10_000)):
        with pytest.raises(InputError, match=r"fits the 0\.001 GB of memory that are free.*take fewer drives") as told:
            ask()
        assert "\n" not in str(told.value)


@pytest.mark.parametrize(("n_drives", "n_twist"), [(800, 31), pytest.param(16, 400, marks=pytest.mark.slow)])
def test_the_estimate_is_an_upper_bound_within_a_factor_of_five(n_drives: int, n_twist: int) -> None:
    drive = sm.load_drive("drive_1", cage_offset="0 um")
    twist = np.linspace(0, drive.max_twist, n_twist)
    sm.simulate(drive, twist[:2], 16).curve()  # tables and imports that remain allocated
    tracemalloc.start()
    try:
        sm.simulate(drive, twist, n_drives).curve()
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 0.2 * memory_needed(drive, n_drives, n_twist) < most < memory_needed(drive, n_drives, n_twist)


def test_blocks_are_stored_in_the_order_of_their_drives() -> None:
    """The last block is incomplete."""
    drive = sm.load_drive("drive_1")
    assert population.sampling.BLOCK == 16
    many = sm.simulate(drive, [0.001, 0.002], 37, seed=4)
    for count in (16, 20, 32):
        few = sm.simulate(drive, [0.001, 0.002], count, seed=4)
        for name in ("torque", "crank_torque", "contact_force", "load_share"):
            np.testing.assert_allclose(getattr(many, name)[:count], getattr(few, name), rtol=1e-9)
