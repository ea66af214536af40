"""Helpers for tests of other processes that keep them independent of the machine's speed."""

from __future__ import annotations

import re

TIMEOUT = 3600.0
"""Seconds after which a process counts as hanging; chosen by judgement, far above the duration of any test."""
_PROGRESS = re.compile(r".+: \d+ %(, .*)?")


def messages(stderr: str) -> list[str]:
    """Lines that a command wrote to standard error, without its progress lines, whose number depends on the time taken.

    >>> messages("solving: 40 %\\nreefmu: interrupted\\n")
    ['reefmu: interrupted']
    """
    return [line for line in stderr.splitlines() if line and not _PROGRESS.fullmatch(line)]
