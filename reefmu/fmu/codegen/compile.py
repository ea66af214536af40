"""Binaries of a native FMU: platforms, compilers and compilation.

The C compiler on the PATH compiles for the platform of the machine; ziglang (the extra `native`) compiles on any
platform for any other. Folders have the names of FMI 2.0 where it defines one, else those of FMI 3.0.
"""

from __future__ import annotations

import os
import platform
import shutil
import struct
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from reefmu.progress import Progress
from stiffness_model.errors import InputError, install_command, unknown_name

from .compiler_run import ZIG, ZIG_FLAGS, compile_cached, first_line, has_zig, zig_version


@dataclass(frozen=True)
class Platform:
    """folder: in `binaries`; targets: names that zig uses, several for a library of several architectures."""

    name: str
    folder: str
    suffix: str
    targets: tuple[str, ...]


PLATFORMS = {
    p.name: p
    for p in (
        Platform("linux64", "linux64", ".so", ("x86_64-linux-gnu.2.17",)),
        Platform("linux-arm64", "aarch64-linux", ".so", ("aarch64-linux-gnu.2.17",)),
        Platform("win64", "win64", ".dll", ("x86_64-windows-gnu",)),
        Platform("darwin64", "darwin64", ".dylib", ("x86_64-macos.11.0", "aarch64-macos.11.0")),
    )
}
"""darwin64 is one library for x86-64 and arm64."""
_FLAGS = (
    "-std=c99",
    "-O2",
    "-fPIC",
    "-shared",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffp-contract=off",
    "-fvisibility=hidden",
    "-fno-asynchronous-unwind-tables",
    "-DFMI2_OVERRIDE_FUNCTION_PREFIX",
    "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
)
"""-ffp-contract=off prevents fused multiply-add, so that every platform rounds in the same way. C throws no exceptions,
and needs no tables by which to unwind the stack."""
_SYMVER_FILE = "old_names.h"
_SYMVER_HEADER = (
    "#include <features.h>\n#ifdef __GLIBC__\n"
    + "".join(f'__asm__(".symver {name},{name}@GLIBC_2.2.5");\n' for name in ("exp", "log", "pow", "exp2", "log2"))
    + "#endif\n"
)
"""For libraries that the local compiler builds for Linux: newer versions of glibc give these functions a new symbol,
but the oldest one is equivalent here and available everywhere. zig receives a version of glibc instead."""
_ZIG_NAMES = {"arm64": "aarch64", "amd64": "x86_64"}
"""Names of processors in zig's targets, where `platform.machine` gives another."""
_LINKER_FLAGS = {"linux": ("-s", "-Wl,--build-id=none", "-lm"), "darwin": ("-Wl,-x", "-lm"), "win32": ("-s", "-lm")}
PAUSE, LONG = 1.0, 5.0
"""s: between two looks at the compilers, and after which the progress explains a long build; chosen by judgement."""
FIRST_BUILD = "the first build for a platform also compiles the libraries of the compiler"
"""For Windows it takes 90 s of processor time, for the others 4 s each, and each further build 0.6 s (zig 0.17.1,
23 November 2026)."""


def host_platform() -> str:
    """The name of this machine's platform in `PLATFORMS`, or "" for another machine."""
    machine = platform.machine().lower()
    if sys.platform == "darwin":
        return "darwin64"
    if machine in ("x86_64", "amd64"):
        return {"linux": "linux64", "win32": "win64"}.get(sys.platform, "")
    return "linux-arm64" if machine in ("aarch64", "arm64") and sys.platform == "linux" else ""


def select_platforms(name: str) -> tuple[Platform, ...]:
    """The platforms for a name, "host" or "all". Errors: `UnknownNameError` with the known names."""
    if name == "all":
        return tuple(PLATFORMS.values())
    known = host_platform() if name == "host" else name
    if known not in PLATFORMS:
        raise unknown_name("platform", known or platform.machine(), (*PLATFORMS, "host", "all"), "--platform")
    return (PLATFORMS[known],)


def compile_binaries(
    sources: Mapping[str, bytes],
    identifier: str,
    platforms: Sequence[Platform],
    beside: Mapping[Future[bytes | None], str] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Binaries by name in the archive, compiled or from the cache, several at a time.

    sources: C files by name. identifier: model identifier, which names the libraries. beside: what else is compiled
    meanwhile, with its name in the progress, which ends when all is done. Errors: `InputError` without a
    compiler for one of the platforms, or with the message of the compiler.
    """
    members: dict[str, bytes] = {}
    jobs = [(p, target) for p in platforms for target in p.targets]
    parts: dict[str, list[bytes]] = {p.name: [] for p in platforms}
    total = len(jobs) + len(beside)
    with Progress("compiling", total) as progress, ThreadPoolExecutor(os.cpu_count()) as pool:
        started, zig = time.monotonic(), any(_program(p) == ZIG for p in platforms)
        futures = {pool.submit(_compile_for, sources, identifier, p, target): target for p, target in jobs}
        names: dict[Future[Any], str] = {**futures, **beside}
        pending = set(names)
        while pending:
            done, pending = wait(pending, timeout=PAUSE, return_when=FIRST_COMPLETED)
            now = ", ".join(target for future, target in names.items() if future.running())
            reason = f"; {FIRST_BUILD}" if zig and time.monotonic() - started > LONG else ""
            progress.advance_to(1 - len(pending) / total, now + reason)
            for future in done:
                future.result()
    for (p, _), future in zip(jobs, futures, strict=True):
        parts[p.name].append(future.result())
    for p in platforms:
        slices = parts[p.name]
        content = slices[0] if len(slices) == 1 else universal_library(slices)
        members[f"binaries/{p.folder}/{identifier}{p.suffix}"] = content
    return members


def compile_for_host(sources: Mapping[str, bytes], name: str, include: Path, library: Path) -> bytes:
    """A shared library for this machine, compiled or from the cache.

    sources: C files by name; `MAIN_SOURCE` is compiled. name: of the library, without suffix. include: folder of
    further headers; library: to link with. Errors: as of `compile_binaries`, and for an unknown machine.
    """
    (p,) = select_platforms("host")
    machine = platform.machine().lower()
    target = next((t for t in p.targets if t.startswith(_ZIG_NAMES.get(machine, machine))), p.targets[0])
    return _compile_for(sources, name, p, target, (f"-I{include}",), (str(library),))


def _compile_for(
    sources: Mapping[str, bytes],
    identifier: str,
    p: Platform,
    target: str,
    options: tuple[str, ...] = (),
    libraries: tuple[str, ...] = (),
) -> bytes:
    command, version = _compiler(p, target)
    link = (
        _LINKER_FLAGS.get(sys.platform, ())
        if "zig" not in version
        else ((f"-Wl,-install_name,@rpath/{identifier}{p.suffix}",) if "macos" in target else ("-lm",))
    )
    files = {**sources, _SYMVER_FILE: _SYMVER_HEADER.encode()}
    return compile_cached(files, f"{identifier}{p.suffix}", (*command, *options), version, (*libraries, *link), p.name)


def has_compiler(platform: str = "host") -> bool:
    """Whether there is a compiler for `platform` (see `select_platforms`); False for an unknown machine."""
    if platform == "host" and not host_platform():
        return False
    return all(_program(p) for p in select_platforms(platform))


def _program(p: Platform) -> tuple[str, ...]:
    """The command of the local compiler ($CC or on the PATH) for this machine, else of zig; () without either."""
    own = os.environ.get("CC", "").split() or [name for name in ("cc", "gcc", "clang") if shutil.which(name)][:1]
    if p.name == host_platform() and len(p.targets) == 1 and own and shutil.which(own[0]):
        return tuple(own)
    return ZIG if has_zig() else ()


def _compiler(p: Platform, target: str) -> tuple[tuple[str, ...], str]:
    """Command with flags, and version, of the compiler for a target."""
    program = _program(p)
    if not program:
        own = os.environ.get("CC", "").split()
        came = (
            "none"
            if p.name != host_platform()
            else "neither ziglang nor "
            + (f"the program that CC names ({own[0]})" if own else "a C compiler on the PATH")
        )
        raise InputError(
            f"{p.name}: expected a compiler for it ({install_command('native')} brings ziglang), got {came}"
        )
    if program == ZIG:
        return (*ZIG, "cc", "-target", target, *_FLAGS, *ZIG_FLAGS), zig_version()
    old = ("-include", _SYMVER_FILE) if p.name == "linux64" else ()
    return (*program, *_FLAGS, *old), first_line([*program, "--version"])


def universal_library(slices: Sequence[bytes]) -> bytes:
    """One macOS library for several architectures ("fat" Mach-O): a big-endian table, then the libraries.

    slices: 64-bit Mach-O libraries, whose headers state their processor.
    """
    page = 14  # log2 of the alignment: 2**14 bytes, the larger page size of both architectures
    table, body, at = [], b"", 1 << page
    for content in slices:
        magic, processor, kind = struct.unpack_from("<III", content)
        assert magic == 0xFEEDFACF
        table.append(struct.pack(">IIIII", processor, kind, at, len(content), page))
        padded = content + bytes(-len(content) % (1 << page))
        body, at = body + padded, at + len(padded)
    header = struct.pack(">II", 0xCAFEBABE, len(slices)) + b"".join(table)
    return header + bytes((1 << page) - len(header)) + body
