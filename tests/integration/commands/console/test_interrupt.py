"""A signal that comes where an exception would be lost, would make Python abort, or would leave a folder behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.subprocesses import TIMEOUT

LOADING = """
import os, signal, sys, time
from importlib.machinery import ExtensionFileLoader
from reefmu.cli.interrupt import Interrupted, signals_raised

def send_signal(frame, event, argument):
    loader, module = (frame.f_back.f_locals.get(name) for name in ("self", "module")) if frame.f_back else (None, None)
    if isinstance(loader, ExtensionFileLoader) and getattr(module, "__name__", "") == "matplotlib.ft2font":
        sys.setprofile(None)
        os.kill(os.getpid(), int(sys.argv[1]))

import numpy
with signals_raised(last=True):
    try:
        sys.setprofile(send_signal)
        import matplotlib.ft2font
        time.sleep(10)
    except Interrupted as stop:
        print(stop.number, "matplotlib.ft2font" in sys.modules)
"""


DISCARDED = """
import os, sys, time, weakref
from reefmu.cli.interrupt import Interrupted, signals_raised

class Owner:
    pass

with signals_raised(last=True):
    try:
        owner = Owner()
        reference = weakref.ref(owner, lambda _: os.kill(os.getpid(), int(sys.argv[1])))
        del owner
        time.sleep(10)
    except Interrupted as stop:
        print(stop.number)
"""

REPLACED = """
import os, sys
from reefmu.cli.program import main
from reefmu.record import unit_conversion

class Attribute:
    def __set_name__(self, owner, name):
        os.kill(os.getpid(), int(sys.argv[1]))

def registry():
    class Registry:
        attribute = Attribute()

unit_conversion._registry = registry
sys.exit(main(["diagnose", sys.argv[2], "--power-law", "--out", sys.argv[3]]))
"""

FOLDER = """
import os, sys, time
from reefmu.cli.interrupt import Interrupted, signals_raised
from stiffness_model.io.atomic_files import scratch_folder

def send_signal(frame, event, function):
    if event == "c_return" and function.__name__ == sys.argv[2]:
        sys.setprofile(None)
        os.kill(os.getpid(), int(sys.argv[1]))

with signals_raised(last=True):
    try:
        sys.setprofile(send_signal)
        with scratch_folder() as folder:
            (folder / "a.txt").write_text("a")
            (folder / "b.txt").write_text("b")
        time.sleep(10)
    except Interrupted as stop:
        print(stop.number)
"""

posix = pytest.mark.skipif(sys.platform == "win32", reason="foreign host: signals of POSIX")


def run(script: str, *arguments: str, folder: Path) -> tuple[int, str, str]:
    """Exit status and output of a script."""
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        env={**os.environ, "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_compiled_module_is_loaded_before_a_signal_stops_the_command(number: signal.Signals, tmp_path: Path) -> None:
    """Matplotlib's, written with pybind11, makes Python abort where an exception ends its loading."""
    assert run(LOADING, str(int(number)), folder=tmp_path) == (0, f"{int(number)} True\n", "")


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_whose_exception_is_discarded_is_raised_again(number: signal.Signals, tmp_path: Path) -> None:
    """Python discards exceptions of callbacks of weak references, with a traceback."""
    assert run(DISCARDED, str(int(number)), folder=tmp_path) == (0, f"{int(number)}\n", "")


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_whose_exception_an_error_of_the_input_replaces_is_raised_again(
    number: signal.Signals, tmp_path: Path
) -> None:
    """While the library of units is imported: Python before 3.12 replaces the exceptions of `__set_name__`."""
    record = tmp_path / "record.csv"
    record.write_text("time [s],twist [arcmin],output_torque [N.m]\n0,0,0\n1,1,1\n", "utf-8")
    expected = (128 + number, "", "reefmu: interrupted\n")
    assert run(REPLACED, str(int(number)), str(record), str(tmp_path / "out"), folder=tmp_path) == expected


@posix
@pytest.mark.parametrize("call", ["mkdir", "flock", "unlink", "rmdir"])
def test_a_signal_leaves_no_temporary_folder(call: str, tmp_path: Path) -> None:
    """Directly after it is made, locked, emptied in part and removed."""
    assert run(FOLDER, "15", call, folder=tmp_path) == (0, "15\n", "")
    assert not list(tmp_path.iterdir())
