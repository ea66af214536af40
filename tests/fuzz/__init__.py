"""Fuzz tests: programs that try many invalid inputs, calls and signals, and print every case with a wrong end.

Each has `--seed` and `--count`; `test_fuzz.py` runs a few cases of each.
"""

from __future__ import annotations


def show(line: str) -> None:
    """Print without delay, so that nothing is lost when the program is stopped."""
    print(line, flush=True)
