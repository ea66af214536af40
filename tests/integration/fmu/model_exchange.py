"""A model-exchange instance of a native FMU in FMPy, for tests that change inputs at constant states."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model
from numpy.typing import NDArray


class Exchange:
    """An instance in continuous-time mode. names: of all variables, in the order of value references."""

    def __init__(self, folder: Path, values: dict[str, float], stop: float | None = None) -> None:
        description = fmpy.read_model_description(str(folder), validate=False)
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.names = tuple(v.name for v in description.modelVariables)
        self.inputs, self.outputs = (
            [v.name for v in description.modelVariables if v.causality == causality]
            for causality in ("input", "output")
        )
        self.derivatives = [unknown.variable.name for unknown in description.derivatives]
        self.states = [unknown.variable.derivative.name for unknown in description.derivatives]
        self.fmu = FMU2Model(
            guid=description.guid,
            unzipDirectory=str(folder),
            instanceName="exchange",
            modelIdentifier=description.modelExchange.modelIdentifier,
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(stopTime=stop)
        self.set(values)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.fmu.newDiscreteStates()
        self.fmu.enterContinuousTimeMode()

    def set(self, values: dict[str, float]) -> None:
        self.fmu.setReal([self.references[name] for name in values], list(values.values()))

    def get(self, names: Sequence[str]) -> NDArray[np.float64]:
        return np.array(self.fmu.getReal([self.references[name] for name in names]))

    def set_states(self, states: NDArray[np.float64]) -> None:
        self.fmu.setContinuousStates(
            np.ascontiguousarray(states).ctypes.data_as(ctypes.POINTER(ctypes.c_double)), len(states)
        )

    def completed(self) -> tuple[bool, bool]:
        """Complete an integrator step; returns whether an event is needed and whether to terminate."""
        event, terminate = self.fmu.completedIntegratorStep()
        return bool(event), bool(terminate)

    def tangent(self, of: Sequence[str], along: Sequence[str], direction: Sequence[float]) -> NDArray[np.float64]:
        return np.array(
            self.fmu.getDirectionalDerivative(
                [self.references[name] for name in of], [self.references[name] for name in along], list(direction)
            )
        )

    def __enter__(self) -> Exchange:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()
