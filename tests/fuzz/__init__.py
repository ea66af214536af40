"""Attacks: programs that try many hostile inputs, calls and kills, and print every case that does not end well.

Each has `--seed` and `--count`; `test_fuzz.py` runs a few cases of each.
"""

from __future__ import annotations


def show(line: str) -> None:
    """Print at once, for whoever stops the attack before its end."""
    print(line, flush=True)
