"""Computing time of an individual: torque maps, a turn under load, and steps of its model and FMU.

    python tests/benchmarks/populations/bench_rotation.py [--drive drive_1] [--seed 3] [--sample 12]

The map has 61 twists x 120 angles. The paper's method (root of eq. 15, `equilibrium.reference`) computes `sample` of
its points in the same run; the ratio is per point. The best of five counts, because other work on the machine only
adds. The steps of the mean drive are printed for comparison.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import tempfile
import time
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import reefmu
import stiffness_model as sm
from reefmu.fmu.export import export_fmu
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.equilibrium.reference import solve_element
from stiffness_model.errors import DoesNotFitWarning
from stiffness_model.lookup.build_lookup import build_lookup
from stiffness_model.rotation import angles_over_turn, draw_individual, loaded_turn, no_load, turning_map
from stiffness_model.rotation.element_positions import element_positions
from stiffness_model.rotation.individual_contacts import IndividualContacts

TWISTS, ANGLES = 61, 120
HOST = Path(__file__).parents[2] / "integration" / "fmu" / "host" / "host.c"
WRAPPER = Path(reefmu.__file__).parent / "fmu" / "native" / "fmi2"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drive", default="drive_1")
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--sample", type=int, default=12)
    args = parser.parse_args()
    warnings.simplefilter("ignore", DoesNotFitWarning)
    drive = sm.load_drive(args.drive)
    one = draw_individual(drive, args.seed)
    twist = np.linspace(-1, 1, TWISTS) * drive.max_twist
    angle = 2 * np.pi / drive.transmission_ratio * np.arange(ANGLES) / ANGLES
    took = best(lambda: turning_map(one, twist, angle))
    print(f"map {TWISTS} x {ANGLES}: {1e3 * took:.0f} ms, {1e6 * took / (TWISTS * ANGLES):.2f} us per point")
    root, off = papers_method(one, twist, angle, args.sample)
    print(
        f"the paper's method: {1e3 * root:.1f} ms per point, {root / took * TWISTS * ANGLES:.0f} times the map's; "
        f"torques differ by {off:.1g} of the greatest"
    )
    whole = angles_over_turn(drive, 8)
    full = float(turning_map(one, [drive.max_twist], angle).torque.mean())
    under = best(lambda: loaded_turn(one, full, whole), 1)
    free = best(lambda: no_load(one, whole), 1)
    print(f"a turn of the output, {len(whole)} angles: under full torque {under:.2f} s, without load {free:.2f} s")
    lookup = build_lookup(drive, n_drives=16)
    models = {
        "mean": build_model(drive, lookup=lookup),
        "individual": build_model(drive, lookup=lookup, individual=args.seed),
    }
    for title, model in models.items():
        print(f"{title:10}  model.output {1e6 * in_casadi(model):7.1f} us   {native(model)}")


def papers_method(one: object, twist: np.ndarray, angle: np.ndarray, count: int) -> tuple[float, float]:
    """Time per point of the map, s, and the greatest difference of the torque over its greatest value."""
    parts = IndividualContacts(one)  # type: ignore[arg-type]
    rng = np.random.default_rng(0)
    points = list(zip(rng.choice(twist, count), rng.choice(angle, count), strict=True))
    mine = [turning_map(parts.individual, [t], [a]).torque[0, 0] for t, a in points]
    start, found = time.perf_counter(), []
    for t, a in points:
        at = element_positions(parts.individual, parts.window, np.array([a]))
        contacts = parts.contacts(at)
        torques = [
            solve_element(contacts, k, t * parts.individual.drive.ratio).output_torque for k in range(len(contacts))
        ]
        found.append(float(np.dot(torques, at.weight[0])))
    took = time.perf_counter() - start
    return took / count, float(np.abs(np.subtract(found, mine)).max() / np.abs(mine).max())


def in_casadi(model: DriveModel) -> float:
    """Time per call of the model's output, s, with a thousand calls in one map."""
    u = np.random.default_rng(0).normal(0, 1, (5, 1000))
    u[2] = u[0] / model.drive.ratio - 1e-3 * u[1]
    output = model.output.map(1000)
    p = np.repeat(model.parameter_vector()[:, None], 1000, axis=1)
    return best(lambda: output(np.zeros((0, 1000)), u, p)) / 1000


def native(model: DriveModel, steps: int = 5000) -> str:
    """Text: time per set + doStep + get in a C host, us, and size of the library, kB."""
    if shutil.which("cc") is None:
        return "native: no C compiler on the PATH"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["REEFMU_CACHE"] = str(folder / "cache")
        subprocess.run(
            ["cc", "-O2", "-o", str(folder / "host"), "-I", str(WRAPPER), str(HOST), "-ldl", "-lm", "-lpthread"],
            check=True,
        )
        path = export_fmu(model, folder / "native.fmu", backend="native")
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder / "native")
        library = next((folder / "native").rglob("*.so"))
        done = subprocess.run(
            [str(folder / "host"), str(library), read_archive(path).guid, "time", str(steps)],
            capture_output=True,
            text=True,
            check=True,
        )
        return f"native step {float(done.stdout):7.3f} us, library {library.stat().st_size / 1024:.0f} kB"


def best(work: Callable[[], object], times: int = 5) -> float:
    took = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        took.append(time.perf_counter() - start)
    return min(took)


if __name__ == "__main__":
    main()
