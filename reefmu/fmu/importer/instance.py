"""Run an FMU from Python: set parameters, step with named inputs, read named outputs, save and restore its state.

For co-simulation FMUs of FMI 2.0 and 3.0 with Real (Float64) inputs and outputs, of this package or of another tool.
"""

from __future__ import annotations

import ctypes
import math
import os
import struct
import weakref
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from stiffness_model.errors import InputError, expect, unknown_name

from ..model.variables import INDICATOR_PREFIX
from ..xml.archive import read_archive
from .ctypes_buffers import VariableBlock, one_line, take_messages
from .loading import LoadedFmu
from .saved_values import replace_values


class FmuDrive:
    """One instance of an FMU, unpacked into a temporary folder that `close` removes.

    It is a context manager and may be used by one thread at a time:

        with FmuDrive("drive.fmu", parameters={"band": 1.0}) as drive:
            outputs = drive.initialize({"crank.phi": 0.0})
            outputs = drive.step(1e-3, {"crank.phi": 0.1})

    inputs, outputs, parameters: names, in the order of the FMU; time: s, at the end of the last step. set_values:
    parameter values by name, as declared or as set since; available before `initialize`, when FMI does not allow to
    read them. Every failure is an `InputError` with the messages that the FMU logged.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    time: float
    set_values: dict[str, float]

    def __init__(
        self, path: str | os.PathLike[str], *, parameters: Mapping[str, float] | None = None, name: str = "drive"
    ) -> None:
        """Unpack and instantiate.

        parameters: values by name, in the unit of the FMU; name: of the instance. Errors: `InputError` for a file that
        is not such an FMU or that this machine cannot run, and for an unknown parameter or one out of range.
        """
        import fmpy

        self._path = Path(path)
        self._messages: list[str] = []
        archive = read_archive(self._path)
        expect(
            archive.fmi_version in ("2.0", "3.0") and archive.model_identifier != "",
            "an FMU for co-simulation with FMI 2.0 or 3.0",
            f"one for FMI {archive.fmi_version} by {archive.generation_tool or 'an unnamed tool'}",
            str(self._path),
        )
        self._loaded = LoadedFmu()
        self._release = weakref.finalize(self, self._loaded.release)
        try:
            folder = fmpy.extract(str(self._path), self._loaded.folder)
            description = fmpy.read_model_description(folder, validate=False)
            self.guid = archive.guid
            variables = [v for v in description.modelVariables if v.type in ("Real", "Float64")]
            self._references = {v.name: v.valueReference for v in variables}
            self.inputs, self.outputs, self.parameters = (
                tuple(v.name for v in variables if v.causality == causality)
                for causality in ("input", "output", "parameter")
            )
            self._starts = {v.name: float(v.start) for v in variables if v.start is not None}
            self._input_block = VariableBlock(self._references, self.inputs)
            self._output_block = VariableBlock(self._references, self.outputs)
            self._blocks: dict[tuple[str, ...], VariableBlock] = {}
            if not self._loaded.instantiate(archive, name, self._messages):
                raise RuntimeError("no instance")
            self._prepare(parameters or {})
        except BaseException as error:
            self.close()
            if isinstance(error, Exception) and not isinstance(error, InputError):
                came = one_line(error) + take_messages(self._messages)
                raise InputError(f"{self._path}: expected an FMU that runs here, got {came}") from None
            raise

    def _prepare(self, parameters: Mapping[str, float]) -> None:
        self.time = math.nan
        self.set_values = {name: self._starts[name] for name in self.parameters if name in self._starts}
        for input_name in self.inputs:
            self._input_block.write(input_name, self._starts.get(input_name, 0.0))
        self.set_parameters(parameters)

    def initialize(self, inputs: Mapping[str, float] | None = None, *, start_time: float = 0.0) -> dict[str, float]:
        """Initialise with these inputs (others keep their start value) and return the outputs at `start_time`, s."""
        expect(math.isnan(self.time), "reset() before a second initialize()", "none", str(self._path))
        self._call("fmi2SetupExperiment", False, 0.0, start_time, False, 0.0)
        self._call("fmi2EnterInitializationMode")
        self._set_inputs(inputs or {})
        self._call("fmi2ExitInitializationMode")
        self.time = start_time
        return self.read()

    def reset(self, parameters: Mapping[str, float] | None = None) -> None:
        """Return to the state after instantiation (fmi2Reset) and set `parameters`; `initialize` must follow."""
        self._call("fmi2Reset")
        self._prepare(parameters or {})

    def close(self) -> None:
        """Free the instance, unload its library and remove the unpacked files. Further calls have no effect."""
        self._release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def step(self, dt: float, inputs: Mapping[str, float] | None = None) -> dict[str, float]:
        """Set `inputs` (others keep their value), step by `dt` seconds and return the outputs at the end.

        A step that the FMU discards raises `InputError` and changes no state; it may be repeated with an admissible
        value of the rejected input.
        """
        self._set_inputs(inputs or {})
        self._call("fmi2DoStep", self.time, dt, False)
        self.time += dt
        return self.read()

    def read(self, names: Iterable[str] | None = None) -> dict[str, float]:
        """Values by name: the outputs, or the Real variables `names`."""
        block = self._output_block if names is None else self._block(tuple(names))
        if block.names:
            self._call("fmi2GetReal", block.references, len(block.names), block.values)
        return dict(zip(block.names, block.values, strict=True))

    def derivative(self, of: Iterable[str], along: Mapping[str, float]) -> dict[str, float]:
        """Directional derivative (FMI 2.0.4, section 2.1.9) of the variables `of`, which a native FMU provides.

        along: the direction, as changes of inputs or states by name; all others are held constant. Errors:
        `InputError` for an FMU without directional derivatives, and for variables that cannot take part.
        """
        unknowns, knowns = self._block(tuple(of)), self._block(tuple(along))
        for name, value in along.items():
            knowns.write(name, value)
        self._call(
            "fmi2GetDirectionalDerivative",
            unknowns.references,
            len(unknowns.names),
            knowns.references,
            len(knowns.names),
            knowns.values,
            unknowns.values,
        )
        return dict(zip(unknowns.names, unknowns.values, strict=True))

    def set_parameters(self, parameters: Mapping[str, float]) -> None:
        """Set parameters by name: all of them before `initialize`, only tunable ones afterwards."""
        if not parameters:
            return
        for name in parameters:
            if name not in self.parameters:
                raise unknown_name("parameter", name, self.parameters, str(self._path))
        block = VariableBlock(self._references, tuple(parameters))
        for name, value in parameters.items():
            block.write(name, value)
        self._messages.clear()
        self._call("fmi2SetReal", block.references, len(block.names), block.values)
        if self._messages:  # pythonfmu reports a value out of range in the log only
            raise InputError(f"{self._path}: {self._messages[-1]}")
        self.set_values.update(parameters)

    def save(self) -> bytes:
        """The time and the complete state of the FMU (FMI 2.0.4, section 2.1.8)."""
        state, size = ctypes.c_void_p(), ctypes.c_size_t()
        self._call("fmi2GetFMUstate", ctypes.byref(state))
        self._call("fmi2SerializedFMUstateSize", state, ctypes.byref(size))
        content = ctypes.create_string_buffer(size.value)
        self._call("fmi2SerializeFMUstate", state, content, size.value)
        self._call("fmi2FreeFMUstate", ctypes.byref(state))
        return struct.pack("<d", self.time) + content.raw

    def restore(self, saved: bytes) -> None:
        """Return to a state from `save`, of this instance or of another one of the same FMU."""
        expect(len(saved) > 8, "a state from save()", f"{len(saved)} bytes", str(self._path))
        content, state = saved[8:], ctypes.c_void_p()
        self._call(
            "fmi2DeSerializeFMUstate",
            ctypes.create_string_buffer(content, len(content)),
            len(content),
            ctypes.byref(state),
        )
        self._call("fmi2SetFMUstate", state)
        self._call("fmi2FreeFMUstate", ctypes.byref(state))
        (self.time,) = struct.unpack_from("<d", saved)
        block = self._input_block  # inputs that the next step does not name keep their saved values
        self._call("fmi2GetReal", block.references, len(block.names), block.values)

    def overwrite(self, values: Mapping[str, float]) -> None:
        """Overwrite variables of any kind, including states; the outputs follow with the next step."""
        # Event indicators have no storage of their own: they are read from the derivatives.
        names = sorted(
            (name for name in self._references if name != "time" and not name.startswith(INDICATOR_PREFIX)),
            key=lambda name: self._references[name],
        )
        present = list(self.read(names).values())
        saved = self.save()
        self.restore(saved[:8] + replace_values(saved[8:], present, {names.index(n): v for n, v in values.items()}))

    def _block(self, names: tuple[str, ...]) -> VariableBlock:
        """The block of these names, cached because a master reads the same names in every step."""
        if names not in self._blocks:
            self._blocks[names] = VariableBlock(self._references, names)
        return self._blocks[names]

    def _set_inputs(self, inputs: Mapping[str, float]) -> None:
        block = self._input_block
        for name, value in inputs.items():
            if name not in block.position:
                raise unknown_name("input", name, self.inputs, str(self._path))
            block.write(name, value)
        if block.names:
            self._call("fmi2SetReal", block.references, len(block.names), block.values)

    def _call(self, function: str, *arguments: Any) -> None:
        fmu = self._loaded.fmu
        if fmu is None:
            raise InputError(f"{self._path}: expected an open FMU, got one that was closed or has failed")
        from fmpy.fmi1 import FMICallException
        from fmpy.fmi2 import fmi2Fatal

        try:
            getattr(fmu, function)(fmu.component, *arguments)
        except FMICallException as error:
            logged = take_messages(self._messages)
            if error.status == fmi2Fatal:
                self._loaded.unusable = True
                self.close()
            raise InputError(f"{self._path}: {one_line(error).rstrip('.')}{logged}") from None
