"""A few seeded cases of each fuzz test; the programs in this folder try any number."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from tests.fuzz import fuzz_record, kill_commands

pytestmark = pytest.mark.slow

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="foreign host: processes of Linux")


def test_invalid_records_end_with_a_verdict_or_one_line() -> None:
    reports: list[str] = []
    assert fuzz_record.attack(11, 40, quick=True, report=reports.append) == 0, "\n".join(reports)


@pytest.mark.skipif(os.name != "posix", reason="foreign host: forks of POSIX")
def test_invalid_calls_end_with_one_line() -> None:
    from tests.fuzz import fuzz_cli

    reports: list[str] = []
    assert fuzz_cli.attack(12, 16, reports.append) == 0, "\n".join(reports)


@linux
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("name", ["curve", "diagnose"])
def test_a_command_that_is_stopped_leaves_nothing(tmp_path: Path, name: str, number: signal.Signals) -> None:
    kill_commands.make_files(tmp_path)
    assert kill_commands.kill_case(tmp_path, name, number, group=False, after=1.0) == ""
    if number == signal.SIGKILL:
        assert kill_commands.run_again(tmp_path, name) == ""
