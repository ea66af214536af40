"""Computing time and size of the native FMU: per step in a C host and in FMPy, and per export.

    python tests/benchmarks/simulation/bench_native.py [--rounds 30] [--drift 100000] [--platforms]

For comparison the same run has an FMU that does nothing, one that only looks up a table (bare_fmu.c), and the Python
back end in the same loop. Rounds are short and alternate; the best counts, because other work on the machine only adds.
`--drift` steps of a closed loop, a drive with a load, are compared with the Python model.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import subprocess
import tempfile
import time
import warnings
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import fmpy
import numpy as np

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.joint_component import joint_component
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from stiffness_model.errors import DoesNotFitWarning
from stiffness_model.lookup.build_lookup import build_lookup

HERE = Path(__file__).parent
MASSES = Masses(1e-4, 2.0)
Round = Callable[[], float]
"""Seconds per step of one short round."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=30)
    parser.add_argument("--drift", type=int, default=100_000)
    parser.add_argument(
        "--platforms", action="store_true", help="all platforms at once, twice: time, size, whether the bytes are equal"
    )
    args = parser.parse_args()
    warnings.simplefilter("ignore", DoesNotFitWarning)
    drive = sm.load_drive("drive_1")
    lookup = build_lookup(drive, n_drives=16)
    models = {
        "plain drive": build_model(drive, lookup=lookup),
        "all effects": nominal(build_model(drive, {n: {} for n in EFFECTS}, lookup=lookup)),
    }
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        os.environ["REEFMU_CACHE"] = str(folder / "cache")  # compiling is part of an export
        flags = ("-fPIC", "-shared")
        loop = ctypes.CDLL(str(compile_c(folder / "loop.so", *flags, str(HERE / "loop.c")))).loop
        loop.restype = ctypes.c_double
        nothing = compile_c(folder / "nothing.so", *flags, str(HERE / "bare_fmu.c"))
        table = compile_c(folder / "table.so", *flags, "-DTABLE", str(HERE / "bare_fmu.c"))
        in_c: dict[str, Round] = {"does nothing": bare(loop, nothing), "bare table": bare(loop, table)}
        in_fmpy: dict[str, Round] = {}
        for title, model in models.items():
            paths = {
                "native": exported(model, folder / f"{title}.fmu", "native", None),
                "Python": export_fmu(model, folder / f"python {title}.fmu", backend="python"),
            }
            exported(model, folder / f"joint {title}.fmu", "native", MASSES)
            for back_end, path in paths.items():
                in_c[f"{title}, {back_end}"] = stack.enter_context(
                    opened(loop, path, 2000 if back_end == "native" else 20)
                )
            in_fmpy[title] = simulated(paths["native"], folder / title)
            in_fmpy[f"{title}, nothing in it"] = simulated(paths["native"], folder / f"{title} empty", nothing)
        print("set + doStep + get in a loop in C")
        best = alternate(in_c, 10 * args.rounds)
        for title, took in best.items():
            print(f"  {title:22} {took * 1e6:9.4f} us   {took / best['bare table']:8.2f} of the bare table")
        for title in models:
            ratio = best[f"{title}, Python"] / best[f"{title}, native"]
            print(f"  {title}: the Python back end takes {ratio:.0f} times as long as the native one")
        print("FMPy's simulate_fmu, inputs from an array, three outputs recorded")
        best = alternate(in_fmpy, max(1, args.rounds // 3))
        for title in models:
            empty = best[f"{title}, nothing in it"]
            print(
                f"  {title:22} {best[title] * 1e6:9.3f} us   {best[title] / empty:8.2f} of the same FMU with nothing "
                "in it"
            )
        print("1 ms of a joint")
        for title, model in models.items():
            native, python = joint_times(model, folder / f"joint {title}.fmu")
            print(f"  {title:22} {native * 1e6:9.2f} us, in Python {python * 1e6:.0f} us")
        for title, model in models.items():
            off = drift(model, folder / f"{title}.fmu", args.drift)
            print(f"{args.drift} steps of a closed loop, {title}: {off:.2g} of full torque off the Python model")
        if args.platforms:
            every_platform(models["all effects"], folder)


def exported(model: DriveModel, path: Path, backend: str, masses: Masses | None) -> Path:
    """Export, and print time and sizes."""
    start = time.perf_counter()
    export_fmu(model, path, backend=backend, masses=masses)
    took = time.perf_counter() - start
    sizes = {"binaries": 0, "sources": 0, "other": 0}
    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            first = info.filename.split("/")[0]
            sizes[first if first in sizes else "other"] += info.compress_size
    packed = ", ".join(f"{name} {size / 1e3:.0f}" for name, size in sizes.items())
    print(f"{path.stem}: exported in {took:.2f} s, {path.stat().st_size / 1e3:.0f} kB ({packed})")
    return path


def alternate(rounds: Mapping[str, Round], count: int) -> dict[str, float]:
    """Run `count` rounds of each, alternating; the best time of each, s."""
    times = [{title: one() for title, one in rounds.items()} for _ in range(count)]
    assert all(t > 0 for row in times for t in row.values())
    return {title: min(row[title] for row in times) for title in rounds}


def bare(loop: Any, library: Path) -> Round:
    dll = ctypes.CDLL(str(library))
    dll.fmi2Instantiate.restype = ctypes.c_void_p
    made = ctypes.c_void_p(dll.fmi2Instantiate(b"x", 1, b"", b"", None, 0, 0))
    return lambda: loop(dll.fmi2SetReal, dll.fmi2DoStep, dll.fmi2GetReal, made, ctypes.c_long(5000))


@contextmanager
def _unpacked(path: Path) -> Iterator[str]:
    folder = fmpy.extract(str(path))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def opened(loop: Any, path: Path, steps: int) -> Iterator[Round]:
    """The FMU, initialised by FMPy, in the loop in C."""
    with _unpacked(path) as folder:
        fmu = fmpy.instantiate_fmu(folder, fmpy.read_model_description(folder), "CoSimulation")
        fmu.setupExperiment()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        calls = fmu.dll.fmi2SetReal, fmu.dll.fmi2DoStep, fmu.dll.fmi2GetReal, ctypes.c_void_p(fmu.component)
        yield lambda: loop(*calls, ctypes.c_long(steps))
        fmu.terminate()
        fmu.freeInstance()


def simulated(path: Path, folder: Path, library: Path | None = None) -> Round:
    """A simulation by FMPy. library: replaces that of the FMU."""
    fmpy.extract(str(path), str(folder))
    if library is not None:
        shutil.copy(library, next(folder.rglob("*.so")))
    description = fmpy.read_model_description(str(folder))
    steps, dt = 4000, 1e-3
    names = [v.name for v in description.modelVariables if v.causality == "input"]
    signal = np.zeros(steps + 1, dtype=[(name, float) for name in ("time", *names)])
    signal["time"] = dt * np.arange(steps + 1)
    signal["temperature"] = 20.0
    signal["output.phi"] = -1e-3 + 5e-4 * np.sin(signal["time"])

    def one() -> float:
        start = time.perf_counter()
        fmpy.simulate_fmu(
            str(folder),
            stop_time=steps * dt,
            output_interval=dt,
            input=signal,
            validate=False,
            model_description=description,
            output=["output.tau", "crank.tau", "stiffness"],
        )
        return (time.perf_counter() - start) / steps

    return one


def joint_times(model: DriveModel, path: Path) -> tuple[float, float]:
    """Seconds per communication step of 1 ms: native through `FmuDrive`, and the Python joint."""
    component = joint_component(model, MASSES)
    p, x = component.parameter_vector(), component.initial([0.0, 0.0], component.parameter_vector())
    native, python = [], []
    with FmuDrive(path) as joint:
        joint.initialize()
        for k in range(200):
            torque = 10.0 * (-1) ** (k // 7)
            start = time.perf_counter()
            joint.step(1e-3, {"load.tau": torque})
            native.append(time.perf_counter() - start)
            if k < 10:
                start = time.perf_counter()
                x = component.step(x, [0.0, torque], 1e-3, p)
                python.append(time.perf_counter() - start)
    return min(native), min(python)


def every_platform(model: DriveModel, folder: Path) -> None:
    """Export for all platforms twice, compiled anew each time; zig's first build for Windows takes minutes."""
    files = []
    for name in ("one", "two"):
        os.environ["REEFMU_CACHE"] = str(folder / name)
        start = time.perf_counter()
        path = export_fmu(model, folder / "platforms.fmu", backend="native", platform="all")
        print(f"all platforms in {time.perf_counter() - start:.0f} s, {path.stat().st_size / 1e3:.0f} kB")
        files.append(path.read_bytes())
    print("the same bytes in both exports" if files[0] == files[1] else "OTHER BYTES in the second export")
    with zipfile.ZipFile(folder / "platforms.fmu") as archive:
        for info in archive.infolist():
            if info.filename.startswith("binaries/"):
                print(
                    f"  {info.filename.split('/')[1]:14} {info.file_size / 1e3:.0f} kB, packed "
                    f"{info.compress_size / 1e3:.0f} kB"
                )


def nominal(model: DriveModel) -> DriveModel:
    """Every effect at its nominal size."""
    return model.with_parameters(
        {
            p.name: float(np.clip(p.nominal, p.minimum, p.maximum))
            for p in model.parameters
            if p.name != "band" and p.minimum is not None and p.maximum is not None
        }
    )


def compile_c(target: Path, *words: str) -> Path:
    subprocess.run(["cc", "-O2", "-o", str(target), *words], check=True)
    return target


def drift(model: DriveModel, path: Path, steps: int) -> float:
    """Greatest difference of the torque over full torque; FMU and model each drive a damped load of their own."""
    p, dt, inertia, damping = model.parameter_vector(), 1e-4, 20.0, 400.0
    advance, output = model.advance, model.output

    def load(phi: float, w: float, torque: float, k: int) -> tuple[float, float]:
        w += dt / inertia * (torque - damping * w + 100.0 * np.sin(2e-3 * k))
        return phi + dt * w, w

    (phi, w), (phi_c, w_c), worst = (0.0, 0.0), (0.0, 0.0), 0.0
    u = np.array([0.0, 0.0, 0.0, 0.0, 20.0])
    x = model.initial(u, p)
    torque = float(np.asarray(output(x, u, p))[0, 0])
    with FmuDrive(path) as drive:
        torque_c = drive.initialize()["output.tau"]
        for k in range(steps):
            (phi, w), (phi_c, w_c) = load(phi, w, torque, k), load(phi_c, w_c, torque_c, k)
            u[2], u[3] = phi, w
            x = advance(x, u, dt, p)
            torque = float(np.asarray(output(x, u, p))[0, 0])
            torque_c = drive.step(dt, {"output.phi": phi_c, "output.w": w_c})["output.tau"]
            worst = max(worst, abs(torque - torque_c))
    return worst / model.full_torque


if __name__ == "__main__":
    main()
