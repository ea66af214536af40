"""Invalid calls of every command: words, numbers, names, drawings, studies and catalogues.

Run as `python -m tests.fuzz.fuzz_cli --seed 1 --count 200` from the root of the repository. Prints every case that
ends with a traceback, a warning, more than one line on stderr, another status than 0, 1 and 2, or temporary files.
POSIX only. `fuzz_fmu` tries FMUs, `fuzz_record` records.
"""

from __future__ import annotations

import argparse
import importlib.resources
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from stiffness_model.drawing.drive import FIELDS
from tests.fuzz import show
from tests.fuzz.child import error_lines, run
from tests.small_study import tables

Rng = np.random.Generator
SECONDS = 60.0
WORDS = (
    "",
    " ",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-300",
    "0",
    "-1",
    "1.5",
    "1e400",
    "9" * 400,
    "x",
    "é",
    "\n",
    "..",
    "/",
    "/dev/null",
    "folder",
    "-",
    "--",
    "%s%n",
    "drive_1",
    "drive_1\x01",
    "a" * 300,
    "1 mm",
    "-1 um",
    "1e300 mm",
    "nan mm",
    "IT5",
    "IT0",
    "IT99",
    "ISO 3290 G10",
    "5 sigma",
    "1_000",
    "0x10",
    "true",
    "[]",
    "1 parsec",
)
NUMBERS = (
    0,
    -1,
    1,
    3,
    10**6,
    10**30,
    -(10**30),
    0.0,
    1e-300,
    1e300,
    float("nan"),
    float("inf"),
    True,
    "",
    "x",
    [],
    {},
    [1, 2],
    "1 mm",
    "1e300 um",
    "nan um",
    "-5 um",
)
CALLS: dict[str, list[str]] = {
    "curve": ["curve", "SOURCE", "--drives", "4", "--out", "out"],
    "compare": ["compare", "SOURCE", "--drives", "4", "--catalog", "gears.toml", "--out", "out"],
    "export": ["export", "SOURCE", "--drives", "4", "--backend", "native", "--platform", "none", "-o", "out/a.fmu"],
    "explore": ["explore", "study.toml", "--workers", "1", "--out", "out"],
    "draw": ["draw", "SOURCE", "--out", "out"],
    "diagnose": ["diagnose", "record.csv", "--curve", "curve.csv", "--columns", "columns.toml", "--out", "out"],
    "check": ["check", "file.fmu"],
}
OPTIONS: dict[str, list[str]] = {
    "curve": ["--seed", "--individual", "--drives", "--set", "--out"],
    "compare": ["--seed", "--drives", "--catalog"],
    "export": ["--step", "--motor-inertia", "--load-inertia", "--load-damping", "--effect", "--fmi", "--kind"],
    "explore": ["--workers", "--out"],
    "draw": ["--individual", "--chord", "--set"],
    "diagnose": ["--exponent", "--column", "--columns", "--locked", "--curve", "--drive"],
    "check": ["--inertia", "--step"],
}
"""All options with values, except `draw --twist`, `--angle` and `--exaggerate`."""
FILES: dict[str, str] = {
    "record.csv": "t,twist [arcmin],output_torque [N.m]\n"
    + "".join(f"{0.01 * k:.2f},{5 * np.sin(0.1 * k):.6f},{90 * np.sin(0.1 * k):.5f}\n" for k in range(150)),
    "curve.csv": "twist [arcmin],torque [N.m]\n0,0\n1,10\n2,30\n4,80\n8,250\n",
    "columns.toml": 't = "time [s]"\n"twist [arcmin]" = "twist [arcmin]"\n'
    '"output_torque [N.m]" = "output_torque [N.m]"\n',
    "gears.toml": '[[gear]]\nmaker = "Own"\ntype = "X1"\nsource = "own rig"\nstiffness = "50 N.m/arcmin"\n'
    'rated_torque = "120 N.m"\n',
    "file.fmu": "not a zip archive",
}


def _changed(rng: Rng, table: dict[str, Any]) -> str:
    """Replace, remove or rename one value in nested tables, and describe the change."""
    place: Any = table
    path: list[str] = []
    while True:
        keys: list[Any] = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return "nothing"
        key = keys[int(rng.integers(len(keys)))]
        path.append(str(key))
        if isinstance(place[key], dict | list) and place[key] and rng.random() < 0.9:
            place = place[key]
            continue
        break
    kind = rng.random()
    if kind < 0.1 and isinstance(place, dict):
        del place[key]
        return f"without {'.'.join(path)}"
    if kind < 0.15 and isinstance(place, dict):
        place[f"{key}x"] = place.pop(key)
        return f"{'.'.join(path)} renamed"
    place[key] = (
        NUMBERS[int(rng.integers(len(NUMBERS)))] if rng.random() < 0.6 else WORDS[int(rng.integers(len(WORDS)))]
    )
    return f"{'.'.join(path)} = {str(place[key])[:40]!r}"


def _changed_text(rng: Rng, text: str) -> tuple[str, str]:
    k, size = int(rng.integers(len(text) + 1)), int(rng.choice([0, 1, 5, 10**6]))
    put = str(rng.choice(["", "\x00", '"', "=", "[", "nan", "1e999", "[" * 2000, ",", "\n"]))
    return text[:k] + put + text[k + size :], f"{put[:5]!r} for {size} letters at {k}"


def cases(seed: int, count: int) -> Iterator[tuple[str, list[str], dict[str, str]]]:
    """Description, call and files of each case."""
    drawings = importlib.resources.files("stiffness_model") / "presets"
    drawing = tomllib.loads((drawings / "drive_1.toml").read_text("utf-8"))
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        name = str(
            rng.choice(
                ["curve", "compare", "export", "export", "explore", "draw", "diagnose", "check"],
                p=[0.2, 0.15, 0.1, 0.1, 0.15, 0.1, 0.15, 0.05],
            )
        )
        call, files, done = list(CALLS[name]), dict(FILES), ""
        own, study = tomllib.loads(tomli_w.dumps(drawing)), tables(designs=8, drives=2, generations=0)
        how = str(rng.choice(["word", "option", "field", "drawing", "study", "text"]))
        if how == "word":
            k = int(rng.integers(1, len(call)))
            call[k] = WORDS[int(rng.integers(len(WORDS)))]
        elif how == "option":
            call += [str(rng.choice(OPTIONS[name])), WORDS[int(rng.integers(len(WORDS)))]]
        elif how == "field" and "SOURCE" in call and name != "export":
            call += ["--set", f"{rng.choice(list(FIELDS))}={WORDS[int(rng.integers(len(WORDS)))]}"]
        elif how in ("drawing", "field"):
            done = "; ".join(_changed(rng, own) for _ in range(int(rng.integers(1, 3))))
        elif how == "study":
            name, call = "explore", list(CALLS["explore"])
            done = "; ".join(_changed(rng, study) for _ in range(int(rng.integers(1, 3))))
        files |= {"own.toml": _toml(own), "study.toml": _toml(study)}
        if how == "text":
            used = [f for f in files if f in call or (f == "own.toml" and "SOURCE" in call)]
            if used:
                file = str(rng.choice(used))
                files[file], done = _changed_text(rng, files[file])
                done = f"{file}: {done}"
        source = "own.toml" if how in ("drawing", "field", "text") else "drive_1"
        call = [source if word == "SOURCE" else word for word in call]
        yield f"{seed}/{number} {how}: {done}", call, files


def _toml(table: dict[str, Any]) -> str:
    try:
        return tomli_w.dumps(table)
    except (TypeError, ValueError):
        return "x = 1\n"


def run_case(call: list[str], files: dict[str, str], folder: Path) -> str:
    """Errors in the way the call ends; empty if there are none."""
    for name in ("folder", "out"):
        (folder / name).mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text, "utf-8")
    if any("\x00" in word for word in call):
        return ""  # The system does not pass such a word.
    status, err = run(call, folder, SECONDS)
    lines = error_lines(err)
    wrong: list[str] = []
    if status not in (0, 1, 2):
        wrong.append(f"status {status}")
    if status == 2 and (len(lines) != 1 or not lines[0].startswith("reefmu: ")):
        wrong.append("status 2 without one line that says why")
    if status in (0, 1) and lines and not (status == 1 and lines[0].startswith("reefmu: ") and len(lines) == 1):
        wrong.append(f"status {status} with words")
    if rest := [p.name for p in folder.rglob(".*")]:
        wrong.append(f"left behind: {rest}")
    return "\n".join([*wrong, *lines[-12:]]) if wrong else ""


def attack(seed: int, count: int, report: Callable[[str], None] = show) -> int:
    """Number of calls that end wrongly; each is reported."""
    bad = 0
    for what, call, files in cases(seed, count):
        with tempfile.TemporaryDirectory(prefix="fuzz-cli-") as place:
            wrong = run_case(call, files, Path(place) / "here")
        if wrong:
            bad += 1
            report(f"--- {what}\n    {' '.join(word[:60] for word in call)!r}\n{wrong}")
    report(f"{bad} of {count} calls end wrongly")
    return bad


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    given = parser.parse_args()
    raise SystemExit(min(1, attack(given.seed, given.count)))
