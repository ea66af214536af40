"""What keeps tests from depending on how fast a machine is."""

from __future__ import annotations

import re

HANG = 3600.0
"""Seconds after which another process counts as hanging: far beyond what any machine takes for a test."""
_PROGRESS = re.compile(r".+: \d+ %(, .*)?")


def said(stderr: str) -> list[str]:
    """What a command said, without the lines of its progress: these come by the clock, more of them on a slow machine.

    >>> said("solving: 40 %\\nreefmu: interrupted\\n")
    ['reefmu: interrupted']
    """
    return [line for line in stderr.splitlines() if line and not _PROGRESS.fullmatch(line)]
