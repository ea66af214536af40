"""The drive model behind pythonfmu's slave interface, as it runs inside an FMU of the Python back end.

An exported FMU contains a script with an empty subclass of `DriveSlave`, and its equations (`equations_file`); the rest
runs here, in the installed package. SciPy is not loaded, because its `_uarray` crashes where a host in C finalises
Python. All variables are in one array of doubles, indexed by value reference, which is also the state to save.

pythonfmu can answer a call with fmi2OK or, after an exception, with fmi2Fatal; only doStep can also return fmi2Discard.
A value that is not admissible is therefore logged and not set, and doStep returns fmi2Discard until an admissible value
has been set. An illegal call (an unknown value reference, setting an output) is fatal.
"""

from __future__ import annotations

import functools
import json
import logging
import math
import sys
from array import array
from contextlib import suppress
from typing import Any, ClassVar, NoReturn

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from stiffness_model.errors import InputError

from ..model.kernel import StepKernel
from ..model.variables import Interface
from .equations_file import EQUATIONS_FILE, StepEquations, read_equations
from .workarounds import guarded, leak_reference, resource_folder

_SETUP, _INITIALISED, _TERMINATED = "setup", "initialised", "terminated"
_logger = logging.getLogger("reefmu.fmu")


@functools.lru_cache(maxsize=32)
def _load(content: bytes) -> tuple[StepEquations, Interface]:
    """The equations and their interface, shared by all instances of one FMU.

    They are never freed: a host in C finalises Python at the end of the process, after CasADi's library has cleared its
    tables, and freeing a function then crashes the process ("pure virtual method called").
    """
    equations, interface = read_equations(content, EQUATIONS_FILE)
    leak_reference(equations)
    return equations, interface


class DriveSlave(Fmi2Slave):
    """FMI 2.0 co-simulation slave of one component; the script in the FMU sets `fmu_guid`."""

    fmu_guid: ClassVar[str] = ""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        location = str(kwargs["resources"])
        with suppress(ValueError):
            sys.path.remove(location)  # pythonfmu added it to find the script; nothing else may be imported from it
        folder = resource_folder(location)
        try:
            content = (folder / EQUATIONS_FILE).read_bytes()
        except OSError as error:
            raise InputError(f"{folder}: expected {EQUATIONS_FILE}, got {error.strerror or error}") from None
        equations, self.interface = _load(content)
        self.kernel = StepKernel(equations, self.interface)
        self._start_limits = equations.start_limits
        self._values = self.kernel.values
        self._enter(_SETUP)
        self._stale = True  # whether the results must be computed from the start values
        self._rejected: dict[int, str] = {}
        self._last_problem = ""

    def exit_initialization_mode(self) -> None:
        self._refresh()
        if self._stale:
            reason = "; ".join(self._rejected.values()) or self._refusal() or "they are not finite"
            self.log_problem(f"no results at the start: {reason}")
        self._enter(_INITIALISED)

    def _refusal(self) -> str:
        """One line on a torque at the start that is out of reach; empty for one within."""
        from ..model.start.start_parameters import START_TORQUE, refusal

        u, p = (self._values[self.interface.span(block)] for block in ("input", "parameter"))
        return refusal(self._start_limits, u, p, self._values[self.interface[START_TORQUE].reference])

    def terminate(self) -> None:
        self._enter(_TERMINATED)

    def _enter(self, phase: str) -> None:
        """Change the phase, and with it the bounds of the variables that may be set, by value reference."""
        self._phase = phase
        closed = () if phase == _SETUP else ("fixed",)
        self._settable = {
            v.reference: v.limits
            for block in ("input", "parameter")
            for v in self.interface.block(block)
            if v.variability not in closed
        }

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One step; False (fmi2Discard) leaves the state unchanged, so that the host may correct a value and repeat."""
        problem = ""
        if self._rejected:
            problem = "; ".join(self._rejected.values())
        elif self._phase != _INITIALISED:
            problem = "expected doStep between initialisation and termination"
        elif not (step_size > 0 and math.isfinite(step_size)):
            problem = f"expected a communication step above 0 s, got {step_size} s"
        elif self._stale and not self.kernel.initialise():
            problem = self._refusal() or "no finite result at the start with these inputs and parameters"
        elif not self.kernel.step(step_size):
            problem = "no finite result with these inputs and parameters"
        if problem:
            self.log_problem(problem, Fmi2Status.discard, f"step at {current_time:g} s discarded: ")
            return False
        self._stale = False
        return True

    @guarded
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        for reference, value in zip(vrs, values, strict=True):
            low, high = self._settable.get(reference) or self._raise_not_settable(reference)
            if low <= value <= high:  # false for NaN
                self._values[reference] = value
                if self._rejected:
                    self._rejected.pop(reference, None)
            else:
                self._rejected[reference] = self.interface.variables[reference].range_error(value)
                self.log_problem(self._rejected[reference])
        if self._phase == _SETUP:
            self._stale = True

    @guarded
    def get_real(self, vrs: list[int]) -> list[float]:
        if self._phase == _SETUP:
            self._refresh()
        if vrs and not 0 <= min(vrs) <= max(vrs) < len(self._values):
            raise InputError(f"expected value references below {len(self._values)}, got {vrs}")
        values = self._values
        return [values[reference] for reference in vrs]

    def _raise_not_settable(self, reference: int) -> NoReturn:
        if 0 <= reference < len(self._values):
            variable = self.interface.variables[reference]
            raise InputError(
                f"expected a variable that may be set now ({self._phase}), got {variable.name}, "
                f"a {variable.variability} {variable.causality}"
            )
        raise InputError(f"expected value references below {len(self._values)}, got {reference}")

    def _refresh(self) -> None:
        """Compute the results at the start; NaN after a rejected value or without a finite result."""
        if not self._stale:
            return
        if not self._rejected and self.kernel.initialise():
            self._stale = False
            return
        for block in ("output", "local"):
            for variable in self.interface.block(block):
                self._values[variable.reference] = math.nan

    # Saved states: FMI 2.0.4, section 2.1.8.

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "guid": self.fmu_guid,
            "phase": self._phase,
            "stale": self._stale,
            "refused": list(self._rejected.items()),
            "values": list(self._values),
        }

    @guarded
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        came = state.get("guid", "bytes that are not a state")
        if came != self.fmu_guid or len(state["values"]) != len(self._values):
            raise InputError(f"expected a state of FMU {self.fmu_guid}, got {came}")
        self._enter(state["phase"])
        self._stale = state["stale"]
        self._rejected = {int(reference): str(problem) for reference, problem in state["refused"]}
        self._values[:] = array("d", state["values"])

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        # There is no instance here that could survive an exception; `_set_fmu_state` refuses a state without GUID.
        try:
            content = json.loads(state.decode("utf-8"))
        except ValueError:
            return {}
        return content if isinstance(content, dict) else {}

    def log_problem(self, problem: str, status: Fmi2Status = Fmi2Status.error, occasion: str = "") -> None:
        """Write to the host's log and, once, to Python's, because hosts often disable their log."""
        self.log(occasion + problem, status)
        if problem != self._last_problem:
            _logger.error("%s: %s%s", self.instance_name, occasion, problem)
            self._last_problem = problem


# No variable has these types, so pythonfmu's own methods raise an exception.
for _access in ("get_integer", "get_boolean", "get_string", "set_integer", "set_boolean", "set_string"):
    setattr(DriveSlave, _access, guarded(getattr(Fmi2Slave, _access)))
