"""Binaries of a native FMU: platforms, compilers and compilation.

The C compiler on the PATH compiles for the platform of the machine; ziglang (the extra `native`) compiles on any
platform for any other. Folders have the names of FMI 2.0 where it defines one, else those of FMI 3.0.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from reefmu.progress import Progress
from stiffness_model.errors import InputError, unknown_name
from stiffness_model.io.atomic_files import atomic_file, scratch_folder

from .sources import MAIN_SOURCE


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
    "-DFMI2_OVERRIDE_FUNCTION_PREFIX",
    "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
)
"""-ffp-contract=off prevents fused multiply-add, so that every platform rounds in the same way."""
_SYMVER_FILE = "old_names.h"
_SYMVER_HEADER = (
    "#include <features.h>\n#ifdef __GLIBC__\n"
    + "".join(f'__asm__(".symver {name},{name}@GLIBC_2.2.5");\n' for name in ("exp", "log", "pow", "exp2", "log2"))
    + "#endif\n"
)
"""For libraries that the local compiler builds for Linux: newer versions of glibc give these functions a new symbol,
but the oldest one is equivalent here and available everywhere. zig receives a version of glibc instead."""
_ZIG = (sys.executable, "-m", "ziglang")
_ZIG_NAMES = {"arm64": "aarch64", "amd64": "x86_64"}
"""Names of processors in zig's targets, where `platform.machine` gives another."""
_ZIG_FLAGS = ("-s", "-fno-sanitize=all", "-fno-stack-protector", "-g0")
_LINKER_FLAGS = {"linux": ("-s", "-Wl,--build-id=none", "-lm"), "darwin": ("-Wl,-x", "-lm"), "win32": ("-s", "-lm")}


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


def compile_binaries(sources: Mapping[str, bytes], identifier: str, platforms: Sequence[Platform]) -> dict[str, bytes]:
    """Binaries by name in the archive, compiled or from the cache.

    sources: C files by name. identifier: model identifier, which names the libraries. Errors: `InputError` without a
    compiler for one of the platforms, or with the message of the compiler.
    """
    members: dict[str, bytes] = {}
    jobs = [(p, target) for p in platforms for target in p.targets]
    parts: dict[str, list[bytes]] = {p.name: [] for p in platforms}
    with Progress("compiling", len(jobs)) as progress:
        for p, target in jobs:
            parts[p.name].append(_compile_cached(sources, identifier, p, target))
            progress.step()
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
    return _compile_cached(sources, name, p, target, (f"-I{include}",), (str(library),))


def _compile_cached(
    sources: Mapping[str, bytes],
    identifier: str,
    p: Platform,
    target: str,
    options: tuple[str, ...] = (),
    libraries: tuple[str, ...] = (),
) -> bytes:
    from reefmu.model.contacts.tables import cache_folder

    command, version = _compiler(p, target)
    command = (*command, *options)
    digest = hashlib.sha256(repr((identifier, version, command, *libraries)).encode())
    for name in sorted(sources):
        digest.update(name.encode() + hashlib.sha256(sources[name]).digest())
    cached = cache_folder() / f"native-{digest.hexdigest()[:24]}{p.suffix}"
    if cached.is_file():
        return cached.read_bytes()
    with scratch_folder() as folder:
        for name, content in {**sources, _SYMVER_FILE: _SYMVER_HEADER.encode()}.items():
            (folder / name).write_bytes(content)
        output = f"{identifier}{p.suffix}"
        link = (
            _LINKER_FLAGS.get(sys.platform, ())
            if "zig" not in version
            else (("-Wl,-install_name,@rpath/" + output,) if "macos" in target else ("-lm",))
        )
        # File names are relative, so that the name of the temporary folder does not get into the binary.
        done = subprocess.run(
            [*command, MAIN_SOURCE, "-o", output, *libraries, *link],
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            env={**os.environ, "TMPDIR": str(folder)},
        )
        if done.returncode != 0:
            said = " ".join((done.stderr or done.stdout).split())[-400:]
            raise InputError(
                f"{p.name}: expected {command[0]} to compile the model, got status {done.returncode}: {said}"
            )
        library = folder / output
        if not library.is_file():
            raise InputError(f"{p.name}: expected {command[0]} to compile the model, got status 0 without a library")
        content = library.read_bytes()
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(cached) as temporary:
            temporary.write_bytes(content)
    except (OSError, InputError):
        pass  # a cache that cannot be written only costs time
    return content


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
    return () if importlib.util.find_spec("ziglang") is None else _ZIG


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
            f"{p.name}: expected a compiler for it (pip install 'reefmu[native]' brings ziglang), got {came}"
        )
    if program == _ZIG:
        return (*_ZIG, "cc", "-target", target, *_FLAGS, *_ZIG_FLAGS), f"zig {_first_line([*_ZIG, 'version'])}"
    old = ("-include", _SYMVER_FILE) if p.name == "linux64" else ()
    return (*program, *_FLAGS, *old), _first_line([*program, "--version"])


def _first_line(command: Sequence[str]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.partition("\n")[0]
    except OSError as error:
        raise InputError(f"{command[0]}: expected a C compiler, got {error.strerror or error}") from None


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
