"""What the native FMU costs: per step in a C host and in FMPy's loop, per export, and its size.

    python tests/benchmarks/bench_native.py [--steps 100000] [--drift 100000]

Beside it in the same run: an FMU that does nothing, one that only looks up a table (bare_fmu.c), and the Python
back end. Best of 20 rounds in C, of 5 in Python: other work on the machine only ever adds. `--drift` steps of a
closed loop, drive and a load on it, are held against the Python model.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import subprocess
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.fmu.archive import read_archive
from reefmu.fmu.build import export_fmu
from reefmu.fmu.host import FmuDrive
from reefmu.model import DriveModel, build_model
from stiffness_model.lookup import build_lookup

HERE = Path(__file__).parent
WRAPPER = Path(__import__("reefmu").__file__).parent / "fmu" / "native"
HOST = HERE.parent / "reefmu" / "fmu" / "host" / "host.c"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--drift", type=int, default=100_000)
    parser.add_argument("--platforms", action="store_true",
                        help="every platform at once, twice: time, size, same bytes")
    args = parser.parse_args()
    drive = sm.load_drive("drive_1")
    lookup = build_lookup(drive, n_drives=16)
    models = {"plain drive": build_model(drive, lookup=lookup),
              "all effects": nominal(build_model(drive, {n: {} for n in EFFECTS}, lookup=lookup))}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["REEFMU_CACHE"] = str(folder / "cache")  # compiling is part of an export
        compile_c(folder / "host", "-I", str(WRAPPER), str(HOST), "-ldl", "-lm", "-lpthread")
        for bare, flags in (("does nothing", ()), ("bare table", ("-DTABLE",))):
            library = compile_c(folder / f"{bare}.so", "-fPIC", "-shared", *flags, str(HERE / "bare_fmu.c"))
            print(f"{bare:14} C host {in_c(folder / 'host', library, '', args.steps):8.3f} us   "
                  f"ctypes loop {in_python(library, '', args.steps):6.2f} us")
        if args.platforms:
            every_platform(models["all effects"], folder)
        for title, model in models.items():
            start = time.perf_counter()
            path = export_fmu(model, folder / "native.fmu", backend="native")
            took = time.perf_counter() - start
            with zipfile.ZipFile(path) as archive:
                archive.extractall(folder / title)
                packed = sum(i.compress_size for i in archive.infolist() if i.filename.startswith("binaries/"))
            library, guid = next((folder / title).rglob("*.so")), read_archive(path).guid
            print(f"{title:14} C host {in_c(folder / 'host', library, guid, args.steps):8.3f} us   "
                  f"ctypes loop {in_python(library, guid, args.steps):6.2f} us   export {took:.2f} s   library "
                  f"{library.stat().st_size / 1024:.0f} kB, {packed / 1024:.0f} kB packed, FMU "
                  f"{path.stat().st_size / 1024:.0f} kB")
            times = [per_step(export_fmu(model, folder / f"{b}.fmu", backend=b)) for b in ("python", "native")]
            print(f"{'':14} FmuDrive.step: Python back end {times[0]:.1f} us, native {times[1]:.1f} us")
            print(f"{'':14} {args.drift} steps of a closed loop: {drift(model, path, args.drift):.2g} of full torque "
                  "off the Python model")


def every_platform(model: DriveModel, folder: Path) -> None:
    """Export for all platforms twice, each time compiled anew. Takes minutes the first time zig builds for Windows."""
    files = []
    for name in ("one", "two"):
        os.environ["REEFMU_CACHE"] = str(folder / name)
        start = time.perf_counter()
        path = export_fmu(model, folder / "platforms.fmu", backend="native", platform="all")
        print(f"every platform in {time.perf_counter() - start:.0f} s, {path.stat().st_size / 1024:.0f} kB")
        files.append(path.read_bytes())
    print("the same bytes again" if files[0] == files[1] else "OTHER BYTES the second time")
    with zipfile.ZipFile(folder / "platforms.fmu") as archive:
        for info in archive.infolist():
            if info.filename.startswith("binaries/"):
                print(f"  {info.filename.split('/')[1]:14} {info.file_size / 1024:.0f} kB, packed "
                      f"{info.compress_size / 1024:.0f} kB")


def nominal(model: DriveModel) -> DriveModel:
    """Every effect at its nominal size."""
    return model.with_parameters({p.name: float(np.clip(p.nominal, p.minimum, p.maximum)) for p in model.parameters
                                  if p.name != "band" and p.minimum is not None and p.maximum is not None})


def compile_c(target: Path, *words: str) -> Path:
    subprocess.run(["cc", "-O2", "-o", str(target), *words], check=True)
    return target


def in_c(host: Path, library: Path, guid: str, steps: int) -> float:
    """us per set + doStep + get in the C host."""
    done = subprocess.run([str(host), str(library), guid, "time", str(steps)], capture_output=True, text=True,
                          check=True)
    return float(done.stdout)


def in_python(path: Path, guid: str, steps: int) -> float:
    """us for the same calls through ctypes, as FMPy makes them."""
    library = ctypes.CDLL(str(path))
    library.fmi2Instantiate.restype = ctypes.c_void_p
    no_calls = (ctypes.c_void_p * 5)()
    made = ctypes.c_void_p(library.fmi2Instantiate(b"x", 1, guid.encode(), b"", no_calls, 0, 0))
    library.fmi2EnterInitializationMode(made)
    library.fmi2ExitInitializationMode(made)
    references, values = (ctypes.c_uint * 5)(*range(5)), (ctypes.c_double * 5)(0.2, 0, -1e-3, 0, 20)
    output, result = (ctypes.c_uint * 1)(5), (ctypes.c_double * 1)()
    now, dt, n, one = ctypes.c_double(0.0), ctypes.c_double(1e-3), ctypes.c_size_t(5), ctypes.c_size_t(1)

    def loop() -> None:
        for _ in range(steps // 5):
            library.fmi2SetReal(made, references, n, values)
            library.fmi2DoStep(made, now, dt, 1)
            library.fmi2GetReal(made, output, one, result)
    return best(loop) / (steps // 5) * 1e6


def per_step(path: Path) -> float:
    """us per step of `FmuDrive`, which reads all outputs by name."""
    with FmuDrive(path) as drive:
        drive.initialize()

        def loop() -> None:
            for k in range(2000):
                drive.step(1e-3, {"output.phi": -1e-3 + 1e-6 * (k % 100)})
        return best(loop) / 2000 * 1e6


def best(loop: Callable[[], object]) -> float:
    times = []
    for _ in range(5):
        start = time.perf_counter()
        loop()
        times.append(time.perf_counter() - start)
    return min(times)


def drift(model: DriveModel, path: Path, steps: int) -> float:
    """Greatest difference of the torque, each side in its own loop with a damped load."""
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
