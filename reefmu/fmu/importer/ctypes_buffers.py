"""Arrays and callbacks in the form the C functions of an FMU take them."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from stiffness_model.errors import expect, unknown_name
from stiffness_model.io.atomic_files import scratch_folder

_LOG_LENGTH = 20


class VariableBlock:
    """Named Real variables as the arrays fmi2GetReal and fmi2SetReal take, made once."""

    def __init__(self, references: Mapping[str, int], names: tuple[str, ...]) -> None:
        for name in names:
            if name not in references:
                raise unknown_name("variable", name, references)
        self.names = names
        self.position = {name: index for index, name in enumerate(names)}
        self.references = (ctypes.c_uint * len(names))(*(references[name] for name in names))
        self.values = (ctypes.c_double * len(names))()

    def write(self, name: str, value: float) -> None:
        self.values[self.position[name]] = value


class LoadedFmu:
    """A folder with an unpacked FMU, and the instance that runs from it, once there is one."""

    def __init__(self) -> None:
        self._work = ExitStack()
        self.folder = self._work.enter_context(scratch_folder())
        self.fmu: Any = None
        self.unusable = False
        """After fmi2Fatal, or without an instance: FMI allows no call any more."""

    def release(self) -> None:
        """Free the instance, unload the library and remove the folder."""
        fmu, self.fmu = self.fmu, None
        if fmu is not None:
            if not self.unusable:
                with suppress(Exception):
                    fmu.fmi2FreeInstance(fmu.component)
            # A library that is still loaded when the process ends (on Linux the first of pythonfmu's always is)
            # releases its hold on Python twice, into freed memory. After this call there is nothing to release.
            finalize = getattr(fmu.dll, "finalizePythonInterpreter", None)
            if finalize is not None:
                finalize()
            fmu.freeLibrary()
        self._work.close()


def make_callbacks(messages: list[str]) -> Any:
    """FMI callbacks whose logger keeps the latest messages with a status worse than fmi2Warning.

    fmpy's logger proxy, which fills in "%s" and the like, is left out: it knows one logger per process, so a
    second instance would take over the first one's messages and, once freed, take the process down with them.
    """
    import fmpy
    from fmpy import fmi2

    def log(_environment: Any, _name: Any, status: int, _category: Any, message: bytes | None) -> None:
        if status > fmi2.fmi2Warning:
            messages.append((message or b"").decode("utf-8", "replace"))
            del messages[:-_LOG_LENGTH]

    made = fmi2.fmi2CallbackFunctions()
    made.logger = fmi2.fmi2CallbackLoggerTYPE(log)
    made.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    made.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return made


def pythonfmu_location(resources: Path) -> str:
    """The folder as a file URI that pythonfmu 0.7 understands.

    It undoes %20 and no other escape, and ends the process if it does not find its script there. So other
    paths go as they are, and what it will not find is refused here with an `InputError`.
    """
    location = resources.as_uri()
    if "%" in location.replace("%20", ""):
        location = f"file://{'' if resources.as_posix().startswith('/') else '/'}{resources.as_posix()}"
        expect(
            "%20" not in location,
            "a folder for temporary files without '%20' in its name (set TMPDIR)",
            str(resources),
            "FMU",
        )
    named = resources / "slavemodule.txt"
    module = named.read_text("utf-8").partition("\n")[0] if named.is_file() else ""
    expect((resources / f"{module}.py").is_file(), "the script that resources/slavemodule.txt names", module, "FMU")
    return location
