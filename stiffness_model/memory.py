"""Available memory, and the refusal in one line of work that needs more.

Without this check, work that runs out of memory fails in whichever library allocates next, and not every library checks
its allocations.
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
"""Limit and usage of a control group, versions 2 and 1."""


def available() -> float:
    """Bytes that this process can still allocate: the minimum of the machine's free memory and of what the control
    group and the address space (`ulimit -v`) leave; infinite where the system states none of them.
    """
    return max(0.0, min(_free_memory(), _control_group(), _address_space()))


def expect_memory(needed: float, what: str, remedy: str) -> None:
    """Raise `InputError` if `needed` bytes exceed the `available` ones; `what` and `remedy` go into the message.

    >>> expect_memory(1e18, "5 virtual drives", "take fewer drives")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: 5 virtual drives: expected work that fits the ... GB of memory that are free, \
got an estimate of 1e+09 GB; take fewer drives
    """
    free = available()
    if needed > free:
        raise InputError(
            f"{what}: expected work that fits the {free / GIGABYTE:.3g} GB of memory that are free, got "
            f"an estimate of {needed / GIGABYTE:.3g} GB; {remedy}"
        )


def _free_memory() -> float:
    for line in _text(_PROC / "meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            return 1024.0 * int(line.split()[1])
    if sys.platform == "win32":
        return _windows_free_memory()
    # POSIX has no value for free memory; macOS states the installed memory.
    for name in ("SC_AVPHYS_PAGES", "SC_PHYS_PAGES"):
        if name in os.sysconf_names:
            return float(os.sysconf(name) * os.sysconf("SC_PAGE_SIZE"))
    return math.inf


def _control_group() -> float:
    for limit, use in _GROUP_FILES:
        limit_text, used_text = _text(_GROUP / limit).strip(), _text(_GROUP / use).strip()
        if limit_text.isdigit() and used_text.isdigit():
            return float(limit_text) - float(used_text)
    return math.inf


def _address_space() -> float:
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return math.inf
    pages = _text(_PROC / "self" / "statm").split()
    return limit - (int(pages[0]) * resource.getpagesize() if pages else 0.0)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii")
    except (OSError, ValueError):
        return ""


def _windows_free_memory() -> float:
    """ullAvailPhys of GlobalMemoryStatusEx: bytes 16 to 24 of its 64-byte structure."""
    status = (ctypes.c_uint64 * 8)()
    ctypes.cast(status, ctypes.POINTER(ctypes.c_uint32))[0] = ctypes.sizeof(status)
    if sys.platform == "win32" and ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):
        return float(status[2])
    return math.inf
