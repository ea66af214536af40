"""A co-simulation instance of FMI 3.0 with the function names of FMI 2.0, so that one importer serves both."""

from __future__ import annotations

import ctypes
from typing import Any

from .ctypes_buffers import keep_message

_SAME = {
    "fmi2ExitInitializationMode": "fmi3ExitInitializationMode",
    "fmi2Reset": "fmi3Reset",
    "fmi2FreeInstance": "fmi3FreeInstance",
    "fmi2GetFMUstate": "fmi3GetFMUState",
    "fmi2SetFMUstate": "fmi3SetFMUState",
    "fmi2FreeFMUstate": "fmi3FreeFMUState",
    "fmi2SerializedFMUstateSize": "fmi3SerializedFMUStateSize",
}
"""Functions with the same arguments in both versions."""


class Fmi3Slave:
    """FMPy's slave for FMI 3.0 behind those functions of FMI 2.0 that `instance.FmuDrive` calls.

    messages: receives the latest messages with a status worse than fmi3Warning.
    """

    def __init__(self, messages: list[str], **kwargs: Any) -> None:
        from fmpy.fmi3 import FMU3Slave, fmi3IntermediateUpdateCallback, fmi3LogMessageCallback

        def log(_environment: Any, status: int, _category: Any, message: bytes | None) -> None:
            if status > 1:  # fmi3Warning
                keep_message(messages, message)

        self._fmu: Any = FMU3Slave(**kwargs)
        self._log, self._update = fmi3LogMessageCallback(log), fmi3IntermediateUpdateCallback()
        self._experiment: tuple[Any, ...] = (False, 0.0, 0.0, False, 0.0)
        self.component: Any = None
        self.dll = self._fmu.dll

    def __getattr__(self, name: str) -> Any:
        if name not in _SAME:
            raise AttributeError(name)
        return getattr(self._fmu, _SAME[name])

    def instantiate(self, name: str, token: str, resources: str) -> Any:
        """The instance, or None if the FMU gives none."""
        return self._fmu.fmi3InstantiateCoSimulation(
            name.encode(),
            token.encode(),
            resources.encode(),
            False,
            True,
            False,
            False,
            (ctypes.c_uint32 * 0)(),
            0,
            None,
            self._log,
            self._update,
        )

    def freeLibrary(self) -> None:
        self._fmu.freeLibrary()

    def fmi2SetupExperiment(self, _component: Any, *experiment: Any) -> None:
        self._experiment = experiment

    def fmi2EnterInitializationMode(self, component: Any) -> None:
        self._fmu.fmi3EnterInitializationMode(component, *self._experiment)

    def fmi2GetReal(self, component: Any, references: Any, count: int, values: Any) -> None:
        self._fmu.fmi3GetFloat64(component, references, count, values, count)

    def fmi2SetReal(self, component: Any, references: Any, count: int, values: Any) -> None:
        self._fmu.fmi3SetFloat64(component, references, count, values, count)

    def fmi2DoStep(self, component: Any, time: float, step: float, no_return: bool) -> None:
        flags = [ctypes.c_bool() for _ in range(3)]
        reached = ctypes.c_double()
        self._fmu.fmi3DoStep(
            component, time, step, no_return, *(ctypes.byref(flag) for flag in flags), ctypes.byref(reached)
        )

    def fmi2GetDirectionalDerivative(
        self, component: Any, unknowns: Any, n_unknowns: int, knowns: Any, n_knowns: int, seed: Any, result: Any
    ) -> None:
        self._fmu.fmi3GetDirectionalDerivative(
            component, unknowns, n_unknowns, knowns, n_knowns, seed, n_knowns, result, n_unknowns
        )

    def fmi2SerializeFMUstate(self, component: Any, state: Any, content: Any, size: int) -> None:
        self._fmu.fmi3SerializeFMUState(component, state, _bytes(content), size)

    def fmi2DeSerializeFMUstate(self, component: Any, content: Any, size: int, state: Any) -> None:
        self._fmu.fmi3DeserializeFMUState(component, _bytes(content), size, state)


def _bytes(content: Any) -> Any:
    return ctypes.cast(content, ctypes.POINTER(ctypes.c_uint8))
