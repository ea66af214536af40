"""Time per element and twist of the closed form in NumPy, the same as a C loop, and SciPy's root of eq. 15.

    python tests/benchmarks/contacts/bench_equilibrium.py [--drive drive_2] [--elements 700] [--twists 24]

All three run on the same elements; their agreement is printed beside the times. The C loop is compiled with `cc -O2`
and left out, with the reason, where there is no compiler. The test of this program measures no times.
"""

from __future__ import annotations

import argparse
import ctypes
import dataclasses
import shutil
import subprocess
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import stiffness_model as sm
from stiffness_model.contact.element_contacts import Contacts, build_contacts
from stiffness_model.contact.usable_elements import is_usable
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium import reference
from stiffness_model.equilibrium.closed_form import MAX_PASSES, MIN_PASSES, TOLERANCE, Equilibrium, Status, closed_form

SOURCE = Path(__file__).with_name("closed_form.c")
FORCES = ("gear", "crank", "cage_plus", "cage_minus")
_INPUTS = (
    "beta",
    "path_radius",
    "normal_r",
    "normal_t",
    "gear_gap",
    "radius_sum",
    "cage_gap",
    "stiffness_gear",
    "stiffness_crank",
    "stiffness_cage",
)


@dataclass(frozen=True)
class Figures:
    """Median times, ns per element and twist, and greatest differences, as shares of the greatest force.

    c_*: None without a C compiler; `c_missing` then states the reason.
    """

    numpy: float
    c: float | None
    root: float
    c_difference: float | None
    root_difference: float
    c_missing: str = ""


def elements(drive: sm.Drive, n: int) -> Contacts:
    """Contacts of n elements of virtual drives, without those larger than their bores."""
    parts = []
    for block in range(1 + n // 500):
        deviations = sampling.draw(drive, block, sampling.BLOCK, seed=0)
        contacts = build_contacts(drive, deviations)
        parts.append(contacts[is_usable(drive, deviations.beta).ravel() & (contacts.cage_gap >= 0)])
    arrays = {
        f.name: np.concatenate([getattr(p, f.name) for p in parts])[:n]
        for f in dataclasses.fields(Contacts)
        if isinstance(getattr(parts[0], f.name), np.ndarray)
    }
    return dataclasses.replace(parts[0], **arrays)


def c_loop(folder: Path) -> Callable[[Contacts, np.ndarray, Equilibrium], None] | str:
    """The compiled loop, which writes into the arrays of an `Equilibrium`, or the reason why there is none."""
    compiler = shutil.which("cc")
    if compiler is None:
        return "no C compiler (cc) on the PATH"
    library = folder / "closed_form.so"
    done = subprocess.run(
        [compiler, "-O2", "-shared", "-fPIC", str(SOURCE), "-o", str(library), "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        return f"cc failed: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else done.returncode}"
    function = ctypes.CDLL(str(library)).closed_form
    function.restype = None

    def run(contacts: Contacts, twists: np.ndarray, into: Equilibrium) -> None:
        pointers = [ctypes.c_void_p(getattr(contacts, name).ctypes.data) for name in _INPUTS]
        results = [ctypes.c_void_p(getattr(into, f.name).ctypes.data) for f in dataclasses.fields(into)]
        function(
            ctypes.c_ssize_t(len(contacts)),
            ctypes.c_ssize_t(len(twists)),
            ctypes.c_int(MIN_PASSES),
            ctypes.c_int(MAX_PASSES),
            ctypes.c_double(TOLERANCE),
            ctypes.c_double(contacts.eccentricity),
            ctypes.c_void_p(twists.ctypes.data),
            *pointers,
            *results,
        )

    return run


def measure(
    drive: sm.Drive, n_elements: int = 700, n_twists: int = 24, repeats: int = 60, n_roots: int = 400
) -> Figures:
    """Times and agreement on `n_elements` elements at `n_twists` twists up to the drive's greatest."""
    contacts = elements(drive, n_elements)
    twists = np.linspace(0, 1, n_twists + 1)[1:] * drive.max_twist * drive.ratio
    ours = closed_form(contacts, twists)
    size = max(float(getattr(ours, name).max()) for name in FORCES)
    into = Equilibrium(**{f.name: np.empty_like(getattr(ours, f.name)) for f in dataclasses.fields(ours)})
    with tempfile.TemporaryDirectory() as folder:
        loop = c_loop(Path(folder))
        numpy_times, c_times = [], []
        for _ in range(repeats):  # alternating, so that both meet the same disturbances
            numpy_times.append(_seconds(lambda: closed_form(contacts, twists)))
            if not isinstance(loop, str):
                c_times.append(_seconds(lambda: loop(contacts, twists, into)))
    pairs = n_elements * n_twists
    root_time, root_difference = _roots(contacts, twists, ours, n_roots)
    return Figures(
        numpy=1e9 * float(np.median(numpy_times)) / pairs,
        c=1e9 * float(np.median(c_times)) / pairs if c_times else None,
        root=1e9 * root_time,
        c_difference=max(float(np.abs(getattr(ours, name) - getattr(into, name)).max()) for name in FORCES) / size
        if c_times
        else None,
        root_difference=root_difference / size,
        c_missing=loop if isinstance(loop, str) else "",
    )


def _seconds(work: Callable[[], object]) -> float:
    """Processor time, s, which does not count other work on the machine."""
    start = time.process_time()
    work()
    return time.process_time() - start


def _roots(contacts: Contacts, twists: np.ndarray, ours: Equilibrium, n: int) -> tuple[float, float]:
    """Median seconds of one root by SciPy with the exact Jacobian, and the greatest difference, N.

    Only loaded elements whose root the first attempt finds; others take longer or need no search.
    """
    loaded = np.argwhere(ours.status == Status.LOADED)
    times, worst = [], 0.0
    for row, column in np.random.default_rng(0).permutation(loaded)[:n]:
        start = time.process_time()
        theirs = reference.solve_element(contacts, int(column), float(twists[row]))
        took = time.process_time() - start
        if theirs.method == "root":
            times.append(took)
            worst = max(worst, *(abs(getattr(theirs, name) - getattr(ours, name)[row, column]) for name in FORCES))
    return float(np.median(times)), worst


def table(figures: Figures) -> str:
    """The figures as text."""

    def row(name: str, value: float | None, difference: float | None) -> str:
        if value is None:
            return f"  {name:<42} {figures.c_missing}"
        against = "" if difference is None else f"{difference:12.1e}"
        return f"  {name:<42}{value:12.1f}{value / figures.numpy:12.2f}{against}"

    return "\n".join(
        [
            f"  {'per element and twist':<42}{'ns':>12}{'x NumPy':>12}{'difference':>12}",
            row("closed form, NumPy", figures.numpy, None),
            row("closed form, C loop (cc -O2)", figures.c, figures.c_difference),
            row("scipy.optimize.root, exact Jacobian", figures.root, figures.root_difference),
        ]
    )


def block_sizes(drive: sm.Drive, repeats: int = 20) -> str:
    """Times of the NumPy form over the elements times twists of one call, as text."""
    lines = []
    for n_elements, n_twists in ((350, 8), (700, 8), (700, 16), (700, 30), (700, 61), (1400, 61), (2800, 61)):
        contacts = elements(drive, n_elements)
        twists = np.linspace(0, 1, n_twists) * drive.max_twist * drive.ratio
        seconds = float(np.median([_seconds(lambda c=contacts, t=twists: closed_form(c, t)) for _ in range(repeats)]))
        lines.append(
            f"  {n_elements:>5} x {n_twists:<3} = {n_elements * n_twists:>7}"
            f"{1e9 * seconds / (n_elements * n_twists):12.1f} ns"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--drive", nargs="*", default=["drive_1", "drive_2", "drive_3", "workshop"])
    parser.add_argument("--elements", type=int, default=700)
    parser.add_argument("--twists", type=int, default=24)
    options = parser.parse_args()
    warnings.simplefilter("ignore", sm.DoesNotFitWarning)
    for name in options.drive:
        drive = sm.load_drive(name)
        print(f"{name}: {options.elements} elements x {options.twists} twists in one call")
        print(table(measure(drive, options.elements, options.twists)), end="\n\n")
    print(f"{options.drive[0]}: NumPy, elements x twists in one call")
    print(block_sizes(sm.load_drive(options.drive[0])))


if __name__ == "__main__":
    main()
