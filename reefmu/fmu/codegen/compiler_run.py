"""Runs of C compilers, and the cache of what they made."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence

from stiffness_model.errors import InputError
from stiffness_model.io.atomic_files import atomic_file, scratch_folder

from .sources import MAIN_SOURCE

ZIG = (sys.executable, "-m", "ziglang")
ZIG_FLAGS = ("-s", "-fno-sanitize=all", "-fno-stack-protector", "-g0")


def has_zig() -> bool:
    """Whether ziglang is installed, which compiles for any platform."""
    return importlib.util.find_spec("ziglang") is not None


def zig_version() -> str:
    """The version of ziglang, such as "zig 0.13.0"."""
    return f"zig {first_line([*ZIG, 'version'])}"


def first_line(command: Sequence[str]) -> str:
    """The first line that a command prints. Errors: `InputError` for a program that does not start."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.partition("\n")[0]
    except OSError as error:
        raise InputError(f"{command[0]}: expected a C compiler, got {error.strerror or error}") from None


def compile_cached(
    sources: Mapping[str, bytes],
    output: str,
    command: Sequence[str],
    version: str,
    link: Sequence[str] = (),
    where: str = "the page",
) -> bytes:
    """The file `output` that a compiler makes of `MAIN_SOURCE`, or the one in the cache.

    sources: C files by name. command: the compiler with its flags; version: of the compiler, on which the content of
    the cache depends; link: flags after the source. where: what is compiled for, in messages. Errors: `InputError` with
    the message of the compiler.
    """
    from reefmu.model.contacts.tables import cache_folder

    digest = hashlib.sha256(repr((output, version, tuple(command), tuple(link))).encode())
    for file in sorted(sources):
        digest.update(file.encode() + hashlib.sha256(sources[file]).digest())
    cached = cache_folder() / f"native-{digest.hexdigest()[:24]}{os.path.splitext(output)[1]}"
    if cached.is_file():
        return cached.read_bytes()
    with scratch_folder() as folder:
        for file, content in sources.items():
            (folder / file).write_bytes(content)
        # File names are relative, so that the name of the temporary folder does not get into the binary.
        done = subprocess.run(
            [*command, MAIN_SOURCE, "-o", output, *link],
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
                f"{where}: expected {command[0]} to compile the model, got status {done.returncode}: {said}"
            )
        library = folder / output
        if not library.is_file():
            raise InputError(f"{where}: expected {command[0]} to compile the model, got status 0 without a library")
        content = library.read_bytes()
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(cached) as temporary:
            temporary.write_bytes(content)
    except (OSError, InputError):
        pass  # a cache that cannot be written only costs time
    return content
