"""An FMU unpacked, its library loaded and an instance created: by FMPy, for FMI 2.0 and 3.0."""

from __future__ import annotations

import ctypes
import os
import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from stiffness_model.errors import expect
from stiffness_model.io.atomic_files import scratch_folder

from ..xml.archive import SCRIPT_NAME, FmuFile
from .ctypes_buffers import make_callbacks

_LOADING = threading.Lock()
"""FMPy changes the working directory while it loads a library, so only one thread at a time may load one."""


class LoadedFmu:
    """A folder with an unpacked FMU, and the instance that runs from it, once there is one."""

    def __init__(self) -> None:
        self._work = ExitStack()
        self.folder = self._work.enter_context(scratch_folder())
        self.fmu: Any = None
        self.unusable = False
        """Whether FMI allows no further call: after fmi2Fatal, or without an instance."""

    def instantiate(self, archive: FmuFile, name: str, messages: list[str]) -> bool:
        """Load the library of the unpacked FMU and create a co-simulation instance; False if the FMU gives none.

        messages: receives the latest messages of the FMU. Errors: those of FMPy, and `InputError` of
        `pythonfmu_location`.
        """
        resources = Path(self.folder, "resources").resolve()
        arguments = {
            "guid": archive.guid,
            "unzipDirectory": str(self.folder),
            "modelIdentifier": archive.model_identifier,
            "instanceName": name,
        }
        if archive.fmi_version == "3.0":
            from .fmi3_adapter import Fmi3Slave

            with _LOADING:
                fmu: Any = Fmi3Slave(messages, **arguments)
            fmu.component = fmu.instantiate(name, archive.guid, f"{resources}{os.sep}")
        else:
            from fmpy.fmi2 import FMU2Slave, fmi2CoSimulation

            by_pythonfmu = archive.backend == "python" or SCRIPT_NAME in archive.members
            location = pythonfmu_location(resources) if by_pythonfmu else resources.as_uri()
            with _LOADING:
                fmu = FMU2Slave(**arguments)
            fmu.callbacks = make_callbacks(messages)
            fmu.component = fmu.fmi2Instantiate(
                name.encode(),
                fmi2CoSimulation,
                archive.guid.encode(),
                location.encode(),
                ctypes.byref(fmu.callbacks),
                False,
                True,
            )
        self.fmu, self.unusable = fmu, not fmu.component
        return not self.unusable

    def release(self) -> None:
        """Free the instance, unload the library and remove the folder."""
        fmu, self.fmu = self.fmu, None
        if fmu is not None:
            if not self.unusable:
                with suppress(Exception):
                    fmu.fmi2FreeInstance(fmu.component)
            # pythonfmu's library, if still loaded when the process ends (on Linux the first one always is), finalises
            # Python a second time, in freed memory. After this call nothing is left to finalise.
            finalize = getattr(fmu.dll, "finalizePythonInterpreter", None)
            if finalize is not None:
                finalize()
            fmu.freeLibrary()
        self._work.close()


def pythonfmu_location(resources: Path) -> str:
    """The folder as a file URI that pythonfmu 0.7 understands.

    pythonfmu decodes %20 but no other escape, and ends the process if it does not find its script. Other paths are
    therefore passed without escapes. Errors: `InputError` for a path that pythonfmu would not find.
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
