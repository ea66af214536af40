"""Compilation for several platforms: at a time, with a progress that names what is under way."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from reefmu.fmu.codegen import compile as platforms
from reefmu.fmu.codegen.compile import PLATFORMS, compile_binaries
from stiffness_model.errors import InputError
from tests.subprocesses import TIMEOUT


def test_platforms_and_page_are_compiled_at_the_same_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each of three waits for the other two, so that one after another would never end."""
    together = threading.Barrier(3)

    def compiled(*_: object) -> bytes:
        together.wait(TIMEOUT)
        return b"binary"

    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(platforms, "_compile_for", compiled)
    ticks = iter(range(0, 10**6, 100))
    monkeypatch.setattr("reefmu.progress.clock", lambda: next(ticks))
    with ThreadPoolExecutor(1) as pool:
        page = pool.submit(compiled)
        found = compile_binaries({}, "x", [PLATFORMS["linux64"], PLATFORMS["win64"]], {page: "page of the FMU"})
    assert found == {"binaries/linux64/x.so": b"binary", "binaries/win64/x.dll": b"binary"}
    assert page.result() == b"binary"
    assert "compiling: " in capsys.readouterr().err


def test_an_error_of_the_page_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> bytes:
        raise InputError("the page: expected zig to compile the model, got status 1")

    monkeypatch.setattr(platforms, "_compile_for", lambda *_: b"binary")
    with ThreadPoolExecutor(1) as pool, pytest.raises(InputError, match="the page"):
        compile_binaries({}, "x", [PLATFORMS["linux64"]], {pool.submit(refused): "page of the FMU"})
