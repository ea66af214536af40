"""Fixtures shared by all tests: a drive, its lookup, and its model."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import hypothesis
import matplotlib
import pytest

import stiffness_model as sm
from reefmu.cli import BLAS_THREADS
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.table import Lookup

matplotlib.use("Agg")
hypothesis.settings.register_profile("any machine", deadline=None)  # no limit of time for an example
hypothesis.settings.load_profile("any machine")


LONGEST_SOLUTION = 120.0
"""s, for which a worker waits for the lookup of another before it solves its own; five times what it takes."""
OUTSIDE = ("foreign host", "not part of this repository")
"""Reasons of skips that are permitted in CI: hosts (wine, ecospy, libcosimpy) and records that it cannot have."""


def pytest_configure() -> None:
    """Each worker of pytest-xdist gets one thread for linear algebra, because the workers already run in parallel.

    Where pytest was started in the background it ignores the signal of Ctrl-C, and so would the processes of the tests.
    """
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail in CI if a test was skipped for a reason that `OUTSIDE` does not name.

    Elsewhere a test may skip where a compiler or data are missing.
    """
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = [] if reporter is None else reporter.stats.get("skipped", [])
    if (
        os.environ.get("CI") == "true"
        and session.exitstatus == 0
        and not all(any(reason in str(report.longrepr) for reason in OUTSIDE) for report in skipped)
    ):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.fixture(scope="session", autouse=True)
def _static_pages() -> Iterator[None]:
    """FMUs have pages that do not run the drive, which saves a compiler's time; test_page.py tests those that do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("reefmu.fmu.documentation.web_assembly.has_zig", lambda: False)
        yield


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Tables are cached in a folder of the session, also for subprocesses: no test reads those of an older run."""
    base = tmp_path_factory.getbasetemp()
    # The workers share the folder, so that each table is solved once.
    folder = (base if "PYTEST_XDIST_WORKER" not in os.environ else base.parent) / "cache"
    folder.mkdir(exist_ok=True)
    before = os.environ.get("REEFMU_CACHE")
    os.environ["REEFMU_CACHE"] = str(folder)
    yield folder
    if before is None:
        del os.environ["REEFMU_CACHE"]
    else:
        os.environ["REEFMU_CACHE"] = before


@pytest.fixture(autouse=True)
def _no_progress_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stop the clock of the progress, so that the output of a command does not depend on its duration."""
    monkeypatch.setattr("reefmu.progress.clock", lambda: 0.0)


@pytest.fixture(scope="session")
def drive() -> sm.Drive:
    return sm.load_drive("drive_1")


@pytest.fixture(scope="session")
def lookup(drive: sm.Drive, _own_cache: Path) -> Lookup:
    """The lookup that commands use by default: solved once, it serves all tests and workers.

    The first worker of pytest-xdist that needs it solves it on all cores while the others wait for the cache.
    """
    started, done = _own_cache / "lookup started", _own_cache / "lookup done"
    try:
        started.touch(exist_ok=False)
    except FileExistsError:
        deadline = time.monotonic() + LONGEST_SOLUTION
        while not done.exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        return cached_lookup(drive)
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as executor:
        solved = cached_lookup(drive, executor=executor)
    done.touch()
    return solved


@pytest.fixture(scope="session")
def model(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, lookup=lookup)
