"""How much memory this process may still take, and a refusal in one line before work that needs more.

Work that runs out of memory halfway ends in whatever library asks for the next page, and not every one of them looks
whether it got it.
"""

from __future__ import annotations

import ctypes
import math
import os
import sys
from pathlib import Path

from .errors import InputError

GIGABYTE = 1e9
_PROC, _GROUP = Path("/proc"), Path("/sys/fs/cgroup")
_GROUP_FILES = (("memory.max", "memory.current"), ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"))
"""Limit and use of a control group, version 2 and 1."""


def available() -> float:
    """Bytes that this process may still take: the least of what the machine has free, its control group allows and
    the limit of its address space (`ulimit -v`) leaves; infinite where the system tells none of them.
    """
    return max(0.0, min(_machine(), _group(), _address_space()))


def expect_memory(needed: float, what: str, remedy: str) -> None:
    """Raise `InputError` if `needed` bytes for `what` are more than `available`.

    >>> expect_memory(1e18, "5 virtual drives", "take fewer drives")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: 5 virtual drives: expected work that fits the ... GB of memory that are free, \
got an estimate of 1e+09 GB; take fewer drives
    """
    room = available()
    if needed > room:
        raise InputError(
            f"{what}: expected work that fits the {room / GIGABYTE:.3g} GB of memory that are free, got "
            f"an estimate of {needed / GIGABYTE:.3g} GB; {remedy}"
        )


def _machine() -> float:
    for line in _text(_PROC / "meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            return 1024.0 * int(line.split()[1])
    if sys.platform == "win32":
        return _windows()
    # What is free is not told by POSIX; macOS tells what is there.
    for name in ("SC_AVPHYS_PAGES", "SC_PHYS_PAGES"):
        if name in os.sysconf_names:
            return float(os.sysconf(name) * os.sysconf("SC_PAGE_SIZE"))
    return math.inf


def _group() -> float:
    for limit, use in _GROUP_FILES:
        most, taken = _text(_GROUP / limit).strip(), _text(_GROUP / use).strip()
        if most.isdigit() and taken.isdigit():
            return float(most) - float(taken)
    return math.inf


def _address_space() -> float:
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return math.inf
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most == resource.RLIM_INFINITY:
        return math.inf
    pages = _text(_PROC / "self" / "statm").split()
    return most - (int(pages[0]) * resource.getpagesize() if pages else 0.0)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii")
    except (OSError, ValueError):
        return ""


def _windows() -> float:
    """ullAvailPhys of GlobalMemoryStatusEx: bytes 16 to 24 of its structure of 64."""
    status = (ctypes.c_uint64 * 8)()
    ctypes.cast(status, ctypes.POINTER(ctypes.c_uint32))[0] = ctypes.sizeof(status)
    if sys.platform == "win32" and ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):
        return float(status[2])
    return math.inf
