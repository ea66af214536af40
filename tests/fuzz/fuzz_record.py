"""Invalid records for `reefmu diagnose`: each must end with a verdict, or with one line and status 2.

Run as `python -m tests.fuzz.fuzz_record --seed 1 --count 200` from the root of the repository. Prints every case that
ends with a traceback, a warning, more than one line on stderr, or another status.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from reefmu.cli import main
from stiffness_model.numerics.arrays import Array
from tests.fuzz import show
from tests.fuzz.child import error_lines

Table = dict[str, Array]

LEGAL = (0, 1, 2)
EXTREME = (
    0.0,
    -0.0,
    5e-324,
    1e-300,
    1e-160,
    1e-30,
    1e-12,
    1e-9,
    1e-6,
    1e6,
    1e9,
    1e12,
    1e15,
    1e100,
    1e154,
    1e200,
    1e308,
    np.inf,
    np.nan,
)
UNITS = {
    "time": ("s", "ms", "min", "h", "ns", "year"),
    "twist": ("arcmin", "rad", "deg", "rev"),
    "output_torque": ("N.m", "kN.m", "uN.m", "lbf.ft"),
    "crank_angle": ("rad", "deg", "rev"),
    "output_angle": ("rad", "arcsec", "deg"),
    "temperature": ("degC", "K", "degF"),
    "run": ("", "s", "1"),
}
NONSENSE = (
    "",
    "N",
    "9**9**9**9",
    "s**9**9",
    "1/0",
    "m**1e9",
    "((((",
    "°",
    "\x00",
    "N.m" * 200,
    "1e999 s",
    "rad[",
    "%",
    "=",
    "__import__",
    "degC*rad",
    "None",
    "inf s",
    "s^-1",
    "dBm",
    "'",
    "\\",
)
PIECES = (b"\x00", b'"', b"\xff", b",", b"\n", b"e", b"-", b"1" * 400, b'"' + b"x" * 140_000, b"\xef\xbb\xbf", b"nan")


def table(rng: np.random.Generator) -> Table:
    """A plausible record of a gear: loops of twist, with or without the angles."""
    n = int(rng.choice([2, 3, 7, 30, 99, 100, 130, 400, 900]))
    time = np.arange(n) * float(10 ** rng.uniform(-5, 1))
    cycles = float(rng.choice([0.3, 1, 2, 5, 40]))
    wave = np.sin(2 * np.pi * cycles * np.arange(n) / n)
    if rng.random() < 0.3:
        wave = 2 / np.pi * np.arcsin(wave)
    twist = float(10 ** rng.uniform(-4.5, -2)) * wave
    torque = float(10 ** rng.uniform(-1, 3)) * np.sign(wave) * np.abs(wave) ** float(rng.uniform(1, 1.6))
    torque = torque + np.abs(torque).max() * float(rng.choice([0, 1e-3, 2e-2])) * rng.standard_normal(n)
    found = {"time": time, "output_torque": torque}
    if rng.random() < 0.5:
        crank = float(rng.choice([0.0, 1.0, 50.0])) * rng.choice([time, wave])
        found |= {"crank_angle": crank, "output_angle": crank / -29 - twist}
    else:
        found["twist"] = twist
    if rng.random() < 0.4:
        found["run"] = np.floor(np.arange(n) / n * rng.integers(1, 8))
    if rng.random() < 0.3:
        found["temperature"] = 20 + 30 * rng.random() * np.arange(n) / n
    return found


# Changes of a table; each returns a description of the change.


def scale(rng: np.random.Generator, t: Table) -> str:
    name, factor = str(rng.choice(list(t))), float(rng.choice(EXTREME[:-2])) * float(rng.choice([1, -1]))
    with np.errstate(all="ignore"):
        t[name] = t[name] * factor
    return f"{name} times {factor:g}"


def offset(rng: np.random.Generator, t: Table) -> str:
    name, by = str(rng.choice(list(t))), float(rng.choice(EXTREME[:-2])) * float(rng.choice([1, -1]))
    t[name] = t[name] + by
    return f"{name} plus {by:g}"


def constant(rng: np.random.Generator, t: Table) -> str:
    name, value = str(rng.choice(list(t))), float(rng.choice([0.0, 1.0, -1e-3, 1e4]))
    t[name] = np.full_like(t[name], value)
    return f"{name} constant at {value:g}"


def spike(rng: np.random.Generator, t: Table) -> str:
    name, value = str(rng.choice(list(t))), float(rng.choice(EXTREME))
    k = int(rng.integers(len(t[name])))
    t[name] = t[name].copy()
    t[name][k] = value
    return f"{name}[{k}] = {value:g}"


def noise(rng: np.random.Generator, t: Table) -> str:
    name = str(rng.choice([n for n in t if n not in ("time", "run")]))
    t[name] = float(10 ** rng.uniform(-9, 5)) * rng.standard_normal(len(t[name]))
    return f"{name} noise alone"


def steps(rng: np.random.Generator, t: Table) -> str:
    name, levels = str(rng.choice([n for n in t if n != "time"])), int(rng.integers(1, 6))
    top = float(np.abs(t[name]).max()) or 1.0
    with np.errstate(all="ignore"):
        t[name] = np.round(t[name] / top * levels) / levels * top
    return f"{name} in {levels} steps"


def jitter(rng: np.random.Generator, t: Table) -> str:
    size = float(rng.choice([1e-300, 1e-12, 0.3, 1e4]))
    with np.errstate(all="ignore"):
        t["time"] = np.maximum.accumulate(t["time"] + size * float(np.ptp(t["time"])) * rng.random(len(t["time"])))
    return f"time jitters by {size:g}"


def stall(rng: np.random.Generator, t: Table) -> str:
    a = int(rng.integers(len(t["time"])))
    t["time"] = np.where(np.arange(len(t["time"])) > a, t["time"][a], t["time"])
    return f"the clock stands from sample {a}"


def runs(rng: np.random.Generator, t: Table) -> str:
    kind = str(rng.choice(["each", "pairs", "large", "falling"]))
    k = np.arange(len(t["time"]), dtype=float)
    t["run"] = {"each": k, "pairs": k // 2, "large": 9e15 + k // 50 * 2, "falling": -(k // 40)}[kind]
    return f"runs: {kind}"


def mirror(rng: np.random.Generator, t: Table) -> str:
    name = str(rng.choice([n for n in t if n not in ("time", "run")]))
    t[name] = -t[name]
    return f"{name} mirrored"


def same(rng: np.random.Generator, t: Table) -> str:
    a, b = rng.choice([n for n in t if n not in ("time", "run")], 2)
    t[a] = t[b].copy()
    return f"{a} = {b}"


MUTATIONS: tuple[Callable[[np.random.Generator, Table], str], ...] = (
    scale,
    scale,
    offset,
    constant,
    constant,
    spike,
    noise,
    steps,
    jitter,
    stall,
    runs,
    mirror,
    same,
)


def written(rng: np.random.Generator, t: Table) -> tuple[bytes, str]:
    """The content of the file, and a description of the error in its text."""
    names = list(t)
    titles = {
        n: n + (f" [{u}]" if (u := str(rng.choice(UNITS[n])) if rng.random() < 0.3 else UNITS[n][0]) else "")
        for n in names
    }
    error = ""
    kind = rng.random()
    if kind < 0.1:
        name = str(rng.choice(names))
        titles[name] = f"{name} [{rng.choice(NONSENSE)}]"
        error = f"title {titles[name]!r}"
    rows = [",".join(titles[n] for n in names)]
    rows += [",".join(f"{t[n][k]:.17g}" for n in names) for k in range(len(t["time"]))]
    text = "\n".join(rows).encode()
    if 0.1 < kind < 0.2:
        k, piece = int(rng.integers(len(text))), PIECES[int(rng.integers(len(PIECES)))]
        text, error = text[:k] + piece + text[k:], f"{piece[:10]!r} at byte {k}"
    elif 0.2 < kind < 0.25:
        k = int(rng.integers(len(text)))
        text, error = text[:k], f"cut at byte {k}"
    return text, error


def cases(seed: int, count: int) -> Iterator[tuple[str, bytes, list[str]]]:
    """Description, record and options of `diagnose` of each case."""
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        t = table(rng)
        done = [rng.choice(np.array(MUTATIONS, object))(rng, t) for _ in range(int(rng.integers(0, 4)))]
        text, odd = written(rng, t)
        options = [
            ["--power-law"],
            ["--power-law"],
            ["--power-law", "--exponent", "1.5"],
            ["--power-law", "--exponent", "shared"],
            ["--curve", "curve.csv"],
            ["--drive", "drive_1"],
            ["--power-law", "--locked", "output"],
        ][int(rng.integers(7))]
        yield f"{seed}/{number}: {'; '.join([*done, odd])}", text, options


CURVE = "twist [arcmin],torque [N.m]\n0,0\n1,10\n2,30\n4,80\n8,250\n"


def run_case(text: bytes, options: list[str], folder: Path) -> str:
    """Errors in the way `diagnose` ends on this record; empty if there are none."""
    (folder / "record.csv").write_bytes(text)
    (folder / "curve.csv").write_text(CURVE, "utf-8")
    out, err = io.StringIO(), io.StringIO()
    before = Path.cwd()
    os.chdir(folder)
    try:
        with (
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            warnings.catch_warnings(record=True) as caught,
        ):
            warnings.simplefilter("always")
            status = main(["diagnose", "record.csv", *options, "--out", "out"])
    except Exception:
        return traceback.format_exc()
    finally:
        os.chdir(before)
    lines = error_lines(err.getvalue())
    warned = [f"{x.category.__name__}: {x.message} ({Path(x.filename).name}:{x.lineno})" for x in caught]
    wrong = [f"status {status}"] if status not in LEGAL else []
    wrong += warned
    if status == 2 and (len(lines) != 1 or not lines[0].startswith("reefmu: ") or (folder / "out").exists()):
        wrong.append(f"status 2, {len(lines)} lines, out {(folder / 'out').exists()}: {lines[:2]}")
    if status == 0 and (lines or not (folder / "out" / "diagnosis.json").is_file()):
        wrong.append(f"status 0 with {lines[:2]}")
    return "\n".join(wrong)


def attack(seed: int, count: int, quick: bool = False, report: Callable[[str], None] = show) -> int:
    """Number of cases that end wrongly; each is reported. quick: without long records and without drawings."""
    bad = 0
    for what, text, options in cases(seed, count):
        if quick and ("--drive" in options or text.count(b"\n") > 150):
            continue
        with tempfile.TemporaryDirectory(prefix="fuzz-record-") as folder:
            wrong = run_case(text, options, Path(folder))
        if wrong:
            bad += 1
            report(f"--- {what} {' '.join(options)}\n{wrong}")
    report(f"{bad} of {count} records end wrongly")
    return bad


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    given = parser.parse_args()
    raise SystemExit(min(1, attack(given.seed, given.count)))
