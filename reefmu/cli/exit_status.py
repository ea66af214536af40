"""Exit statuses of the program, and what it writes to stderr where it fails."""

from __future__ import annotations

import sys

DONE, FAILED, WRONG_INPUT = 0, 1, 2
"""The command is done; a check failed or the work was lost; the input or the call was wrong."""


def report_error(message: str, status: int) -> int:
    """Write one line to stderr, and return the exit status."""
    print("reefmu: " + " ".join(message.split("\n")), file=sys.stderr)
    return status
