"""The model of a drive compiled to WebAssembly, for the page that runs it."""

from __future__ import annotations

from collections.abc import Mapping

from stiffness_model.errors import install_command

from ..codegen.compiler_run import ZIG, ZIG_FLAGS, compile_cached, has_zig, zig_version
from ..codegen.sources import FMI2_MAIN, MAIN_SOURCE, wrapper_files

WEB_MAIN = "web_all.c"
"""The file to compile for the page, in `native/web`."""
_TARGET = "wasm32-wasi"
"""Its libc (musl) has the functions of math.h. None of those that the model calls needs an import from the host."""
_FLAGS = (
    "-std=c99",
    "-Os",
    "-w",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffp-contract=off",
    "-mexec-model=reactor",
    "-Wl,--no-entry",
)
"""-Os: a fifth smaller than -O2. -ffp-contract=off: the rounding of the native binary."""
NO_COMPILER = (
    "This page was written without the compiler that would have let it run the drive: "
    f"{install_command('native')} brings one."
)


def compile_module(sources: Mapping[str, bytes]) -> bytes | None:
    """The module of a drive, or None where ziglang is not installed.

    sources: of `make_sources` for a component of kind `drive`. Errors: `InputError` with the message of
    the compiler.
    """
    if not has_zig():
        return None
    files = {**sources, **wrapper_files("web"), FMI2_MAIN: sources[MAIN_SOURCE]}
    files[MAIN_SOURCE] = files.pop(WEB_MAIN)
    command = (*ZIG, "cc", "-target", _TARGET, *_FLAGS, *ZIG_FLAGS)
    return compile_cached(files, "page.wasm", command, zig_version())
