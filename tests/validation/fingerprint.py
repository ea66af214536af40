"""What the software writes for fixed inputs, as hashes and as sampled numbers: a move of code must not change it.

    python tests/validation/fingerprint.py            one line per file: exact hash, name
    python tests/validation/fingerprint.py --write    stores the golden fingerprints beside this program

Everything goes through the command line, so the same program measures any layout of the code. Exact hashes serve to
compare two checkouts on one machine. The golden fingerprints serve the test on any machine: the text between the
numbers must be the same, and the numbers to a relative tolerance, since linear algebra differs in its last digits
from one processor to the next.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from stiffness_model.numerics.arrays import Array

GOLDEN = Path(__file__).with_name("fingerprint.json")
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")
MOST_NUMBERS = 60
"""Numbers of one file that the golden fingerprint keeps, evenly spread over the file."""
VOLATILE = re.compile(
    r"seconds|generationDateAndTime|guid|instantiationToken|generationTool|reefmu [0-9.]+", re.IGNORECASE
)
"""Lines with a time, a version or a hash of the rest."""
RATIO = -29.0
"""Of drive_1, crank to output."""
STUDY = """name = "small"
base = "drive_1"
[parameters]
gear_tolerance = { from = "IT5", to = "IT8" }
gear_offset = { from = "-5 um", to = "10 um" }
lobes = { from = 24, to = 34 }
[fixed]
elements_per_row = "fill"
[constraints]
packs = true
undercut = { max = 0.52 }
[objectives]
lost_motion = "min"
no_load_force = "min"
stiffness = "max"
[numbers]
torque = "120 N.m"
designs = 48
drives = 4
twists = 12
generations = 2
population = 16
seed = 3
"""


def artefacts() -> dict[str, bytes]:
    """Every file that the fixed calls write, by a name that says which call wrote it."""
    found: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "study.toml").write_text(STUDY, encoding="utf-8")
        (folder / "drawing.csv").write_text(record(at_once), encoding="utf-8")
        (folder / "power_law.csv").write_text(record(gradually), encoding="utf-8")
        run(folder, "curve", "drive_1", "--drives", "48", "--seed", "3", "--out", "curve")
        found["curve/curve.csv"] = (folder / "curve/curve.csv").read_bytes()
        for kind in ("drive", "joint"):
            run(
                folder,
                "export",
                "drive_1",
                "--kind",
                kind,
                "--backend",
                "native",
                "--platform",
                "none",
                "--drives",
                "48",
                "--effect",
                "hysteresis",
                "--effect",
                "creep",
                "--effect",
                "missing_ball",
                "-o",
                f"{kind}.fmu",
            )
            with zipfile.ZipFile(folder / f"{kind}.fmu") as archive:
                found |= {
                    f"{kind}.fmu/{name}": archive.read(name)
                    for name in archive.namelist()
                    if name.startswith("sources/") or name == "modelDescription.xml"
                }
        run(folder, "explore", "study.toml", "--workers", "1", "--out", "designs")
        found["designs/chosen.toml"] = (folder / "designs/chosen.toml").read_bytes()
        for name, base in (("drawing", ("--drive", "drive_1")), ("power_law", ("--power-law",))):
            run(folder, "diagnose", f"{name}.csv", *base, "--out", name)
            for file in ("diagnosis.json", "model.toml"):
                if (folder / name / file).exists():
                    found[f"{name}/{file}"] = (folder / name / file).read_bytes()
            found[f"{name}/diagnosis.json"] = without_probabilities(found[f"{name}/diagnosis.json"])
    return found


def without_probabilities(content: bytes) -> bytes:
    """diagnosis.json without what simulations count and without intervals, which average over explanations; without the
    alternatives, of which two that are as likely may be on either side of the last percent, nor those that show of an
    ambiguous record, and without the order of others, which is that of their probabilities.

    A last digit decides on which side of a limit a draw is and where a fit of two effects that act alike ends, and it
    depends on the processor's kernels of linear algebra.
    """
    whole = json.loads(content)
    del whole["alternatives"]
    shown = whole["shown_alternatives"]
    whole["shown_alternatives"] = [] if whole["verdict"] == "ambiguous" else sorted(shown)
    for key in ("hypotheses", "global_p", "isolability"):
        del whole[key]
    for effect in whole["effects"]:
        del effect["probability"]
        for parameter in effect["parameters"].values():
            for key in ("low", "high", "warning"):
                parameter.pop(key, None)
    return json.dumps(whole, indent=1).encode()


def at_once(path: Array) -> Array:
    """Friction over that of steady motion, along the path since a reversal, arcmin: it reverses at once."""
    return np.ones_like(path)


def gradually(path: Array) -> Array:
    """The same, reversing over 0.6 arcmin. A power law determines this presliding; that of friction that reverses at
    once is undetermined there, and the sixth digit of the interval of its torque then depends on the processor."""
    return 1 - 2 * np.exp(-path / 0.6)


def record(friction: Callable[[Array], Array]) -> str:
    """A record of two slow loops at two crank angles with friction inside and noise, as CSV."""
    n = 360
    phase = np.arange(n) / 180
    twist = 6.5 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
    noise = np.random.Generator(np.random.PCG64(np.random.SeedSequence(5))).normal(0, 0.5, (2, n))
    rows = ["time [s],run,crank_angle [rad],output_angle [arcmin],output_torque [N.m]"]
    for number, angle in enumerate((0.3, 1.9)):
        direction = np.sign(np.cos(2 * np.pi * phase))
        own = 6.0 * direction * friction(6.5 + direction * twist)
        torque = np.sign(twist) * 11.0 * np.abs(twist) ** 1.5 + own + noise[number]
        rows += [
            f"{0.05 * k + 100 * number:.2f},{number},{angle},{np.degrees(angle / RATIO) * 60 - a:.6f},{b:.5f}"
            for k, (a, b) in enumerate(zip(twist, torque, strict=True))
        ]
    return "\n".join(rows) + "\n"


def run(folder: Path, *words: str) -> None:
    """One call of the command line in `folder`, which must end well."""
    done = subprocess.run(
        [sys.executable, "-m", "reefmu", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "REEFMU_CACHE": str(folder / "cache"), "MPLBACKEND": "Agg"},
    )
    if done.returncode:
        raise SystemExit(f"reefmu {' '.join(words)}: expected status 0, got {done.returncode}: {done.stderr}")


def fingerprint(content: bytes) -> dict[str, object]:
    """The text without its numbers as a hash, how many numbers it has, and some of them."""
    lines = [line for line in content.decode("utf-8").splitlines() if not VOLATILE.search(line)]
    text = "\n".join(lines)
    numbers = [float(n) for n in NUMBER.findall(text)]
    chosen = np.unique(np.linspace(0, len(numbers) - 1, min(MOST_NUMBERS, len(numbers))).astype(int)) if numbers else []
    return {
        "text": hashlib.sha256(NUMBER.sub("#", text).encode()).hexdigest()[:16],
        "count": len(numbers),
        "numbers": [numbers[k] for k in chosen],
    }


def fingerprints() -> dict[str, dict[str, object]]:
    """By file. An FMU's tables are packed integers without a tolerance; the curve stands for them."""
    return {
        name: fingerprint(content) for name, content in sorted(artefacts().items()) if not name.endswith("tables.h")
    }


def main() -> None:
    """Print exact hashes, or store the golden fingerprints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"store {GOLDEN.name}")
    if parser.parse_args().write:
        GOLDEN.write_text(json.dumps(fingerprints(), indent=1) + "\n", encoding="utf-8")
        return
    for name, content in sorted(artefacts().items()):
        kept = b"\n".join(line for line in content.splitlines() if not VOLATILE.search(line.decode("utf-8", "replace")))
        print(hashlib.sha256(kept).hexdigest()[:16], name)


if __name__ == "__main__":
    main()
