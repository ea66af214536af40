"""Commands that are stopped while they work, by SIGINT, SIGTERM and SIGKILL, alone or with their process group.

Run as `python -m tests.fuzz.kill_commands --seed 1 --count 30` from the root of the repository. Prints every case that
ends with another status than 0 or 128 + the signal's number (SIGKILL: -9), with a traceback or more than one line on
stderr, with temporary files or with a worker that still runs. After SIGKILL the next run of the command must remove the
temporary files. Linux only: processes are looked up in /proc.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import tomli_w

from tests.fuzz import show
from tests.fuzz.child import error_lines
from tests.small_study import tables
from tests.subprocesses import TIMEOUT

ROOT = Path(__file__).parents[2]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
COMMANDS: dict[str, tuple[str, ...]] = {
    "curve": ("curve", "drive_1", "--drives", "400", "--out", "out"),
    "individual": ("curve", "drive_2", "--drives", "50", "--individual", "7", "--out", "out"),
    "python": ("export", "drive_1", "--drives", "40", "--backend", "python", "-o", "out/a.fmu"),
    "native": ("export", "drive_1", "--drives", "40", "--backend", "native", "-o", "out/a.fmu"),
    "diagnose": ("diagnose", "record.csv", "--power-law", "--out", "out"),
    "explore": ("explore", "study.toml", "--workers", "2", "--out", "out"),
    "draw": ("draw", "drive_1", "--out", "out"),
}


def make_files(folder: Path) -> None:
    """Make the files that the commands read and empty folders for their results."""
    for name in ("tmp", "work", "work/out", "cache"):
        (folder / name).mkdir()
    (folder / "work" / "study.toml").write_text(tomli_w.dumps(tables(designs=64, drives=12)), "utf-8")
    rng = np.random.default_rng(0)
    k = np.arange(1500)
    twist = 5 * np.sin(2 * np.pi * k / 300)
    torque = 20 * twist + 4 * np.sign(np.cos(2 * np.pi * k / 300)) + 0.3 * rng.standard_normal(len(k))
    np.savetxt(
        folder / "work" / "record.csv",
        np.stack([0.01 * k, twist, torque], axis=1),
        delimiter=",",
        comments="",
        header="time [s],twist [arcmin],output_torque [N.m]",
    )


def start(folder: Path, name: str) -> subprocess.Popen[str]:
    """Start the command in its own session, with its own folder for temporary files."""
    environment = {
        **os.environ,
        "TMPDIR": str(folder / "tmp"),
        "REEFMU_CACHE": str(folder / "cache"),
        "PYTHONPATH": str(ROOT),
    }
    return subprocess.Popen(
        [sys.executable, "-m", "reefmu", *COMMANDS[name]],
        cwd=folder / "work",
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def left(folder: Path) -> list[str]:
    """Temporary files and folders that still exist."""
    tmp = folder / "tmp"
    return sorted(
        str(path.relative_to(folder))
        for path in folder.rglob("*")
        if path.parent == tmp or (path.name.startswith(".") and tmp not in path.parents)
    )


def living(session: int) -> list[int]:
    """Processes of a session that have not ended."""
    found: list[int] = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text("utf-8", "replace").rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(entry.name))
    return found


def kill_case(folder: Path, name: str, number: signal.Signals, group: bool, after: float) -> str:
    """Errors in the way a command ends after a signal; empty if there are none. after: s from start to signal."""
    before = left(folder)
    running = start(folder, name)
    time.sleep(after)
    early = running.poll() is not None
    if not early:
        (os.killpg if group else os.kill)(running.pid, number)
    try:
        _, errors = running.communicate(timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        running.communicate()
        return f"still running after {TIMEOUT:g} s"
    status = running.returncode
    wrong: list[str] = []
    lines = [line for line in error_lines(errors) if line.strip()]
    if number == signal.SIGKILL:
        if status not in (0, -9):
            wrong.append(f"status {status}")
    elif (
        status not in (0, 128 + number)
        or len(lines) != (status != 0)
        or (status and not lines[0].startswith("reefmu: interrupted"))
    ):
        wrong.append(f"status {status}, {lines[-8:]}")
    end = time.monotonic() + 20
    while living(running.pid) and time.monotonic() < end:
        time.sleep(0.02)
    if living(running.pid):
        wrong.append(f"processes still run: {living(running.pid)}")
        for process in living(running.pid):
            os.kill(process, signal.SIGKILL)
    more = sorted(set(left(folder)) - set(before))
    if number != signal.SIGKILL and more:
        wrong.append(f"left behind: {more}")
    return "\n".join(wrong)


def run_again(folder: Path, name: str) -> str:
    """Errors of the next run of the command after the signals; empty if there are none."""
    _, errors = (running := start(folder, name)).communicate(timeout=TIMEOUT)
    wrong = [] if running.returncode == 0 else [f"status {running.returncode}: {errors[-300:]}"]
    return "\n".join([*wrong, *([f"never removed: {left(folder)}"] if left(folder) else [])])


def attack(
    seed: int, count: int, names: tuple[str, ...] = tuple(COMMANDS), report: Callable[[str], None] = show
) -> int:
    """Number of cases that end wrongly; each is reported. Each command gets `count` signals, then runs to its end."""
    bad = 0
    for name in names:
        rng = np.random.default_rng([seed, list(COMMANDS).index(name)])
        with tempfile.TemporaryDirectory(prefix="fuzz-kill-") as place:
            folder = Path(place)
            make_files(folder)
            whole = time.monotonic()
            wrong = run_again(folder, name)
            whole = time.monotonic() - whole
            results = [f"{name}, without signals: {wrong}"] if wrong else []
            for _ in range(count):
                number, group = SIGNALS[int(rng.integers(3))], bool(rng.random() < 0.5)
                after = 0.15 + float(rng.random()) * whole
                wrong = kill_case(folder, name, number, group, after)
                if wrong:
                    results.append(f"{name}, {number.name} {'to all ' if group else ''}after {after:.2f} s: {wrong}")
            if wrong := run_again(folder, name):
                results.append(f"{name}, after the signals: {wrong}")
        bad += len(results)
        for line in results:
            report(f"--- {line}")
    report(f"{bad} of {len(names) * (count + 2)} runs end wrongly")
    return bad


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--command", choices=tuple(COMMANDS), action="append", help="default: all")
    given = parser.parse_args()
    raise SystemExit(min(1, attack(given.seed, given.count, tuple(given.command or COMMANDS))))
