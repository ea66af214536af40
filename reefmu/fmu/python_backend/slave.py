"""What runs inside an FMU of the Python back end: the drive model behind pythonfmu's slave interface.

Every export holds a script of its own with one empty subclass of `DriveSlave`, and its equations (`carried`); the work
is done here, in the installed package. No SciPy is loaded: its `_uarray` crashes where a host in C ends Python. All
variables live in one array of doubles, indexed by value reference, which is also the whole state to save and restore.

pythonfmu can answer a call with OK or, after an exception, with fmi2Fatal; only doStep can also say
fmi2Discard. So a value that cannot be used is logged, kept out and remembered, and doStep discards until a
usable value has come. A call the interface does not have (an unknown value reference, setting an output) is
fatal.
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
    """The equations and their interface: shared by the instances of one FMU and kept over a reset.

    And for ever: a host in C ends Python when the process ends, after CasADi's own library has cleared its tables, and
    a function that is freed then takes the process down ("pure virtual method called").
    """
    equations, interface = read_equations(content, EQUATIONS_FILE)
    leak_reference(equations)
    return equations, interface


class DriveSlave(Fmi2Slave):
    """FMI 2.0 co-simulation slave of one drive model; `fmu_guid` comes from the script."""

    fmu_guid: ClassVar[str] = ""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        location = str(kwargs["resources"])
        with suppress(ValueError):
            sys.path.remove(location)  # pythonfmu put it there to find the script; nothing else may be found
        folder = resource_folder(location)
        try:
            content = (folder / EQUATIONS_FILE).read_bytes()
        except OSError as error:
            raise InputError(f"{folder}: expected {EQUATIONS_FILE}, got {error.strerror or error}") from None
        equations, self.interface = _load(content)
        self.kernel = StepKernel(equations, self.interface)
        self._values = self.kernel.values
        self._enter(_SETUP)
        self._stale = True  # results wait to be computed from the start values
        self._refused: dict[int, str] = {}
        self._last_problem = ""

    # --- life ---------------------------------------------------------------------------------------------

    def exit_initialization_mode(self) -> None:
        self._refresh()
        if self._stale:
            reason = "; ".join(self._refused.values()) or "they are not finite"
            self.log_problem(f"no results at the start: {reason}")
        self._enter(_INITIALISED)

    def terminate(self) -> None:
        self._enter(_TERMINATED)

    def _enter(self, phase: str) -> None:
        """Change the phase, and with it what may be set: value reference -> least and greatest value."""
        self._phase = phase
        closed = () if phase == _SETUP else ("fixed",)
        self._settable = {
            v.reference: v.limits
            for block in ("input", "parameter")
            for v in self.interface.block(block)
            if v.variability not in closed
        }

    def do_step(self, current_time: float, step_size: float) -> bool:
        """False (fmi2Discard) leaves everything as it was: the host may correct a value and step again."""
        problem = ""
        if self._refused:
            problem = "; ".join(self._refused.values())
        elif self._phase != _INITIALISED:
            problem = "expected doStep between initialisation and termination"
        elif not (step_size > 0 and math.isfinite(step_size)):
            problem = f"expected a communication step above 0 s, got {step_size} s"
        elif self._stale and not self.kernel.initialise():
            problem = "no finite result at the start with these inputs and parameters"
        elif not self.kernel.step(step_size):
            problem = "no finite result with these inputs and parameters"
        if problem:
            self.log_problem(problem, Fmi2Status.discard, f"step at {current_time:g} s discarded: ")
            return False
        self._stale = False
        return True

    # --- values -------------------------------------------------------------------------------------------

    @guarded
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        for reference, value in zip(vrs, values, strict=True):
            low, high = self._settable.get(reference) or self._raise_not_settable(reference)
            if low <= value <= high:  # false for NaN as well
                self._values[reference] = value
                if self._refused:
                    self._refused.pop(reference, None)
            else:
                self._refused[reference] = self.interface.variables[reference].range_error(value)
                self.log_problem(self._refused[reference])
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
        """Results at the start. With a refused value, or no finite result, they are NaN, not a guess."""
        if not self._stale:
            return
        if not self._refused and self.kernel.initialise():
            self._stale = False
            return
        for block in ("output", "local"):
            for variable in self.interface.block(block):
                self._values[variable.reference] = math.nan

    # --- state (FMI 2.0.4, section 2.1.8) -----------------------------------------------------------------

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "guid": self.fmu_guid,
            "phase": self._phase,
            "stale": self._stale,
            "refused": list(self._refused.items()),
            "values": list(self._values),
        }

    @guarded
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        came = state.get("guid", "bytes that are no state")
        if came != self.fmu_guid or len(state["values"]) != len(self._values):
            raise InputError(f"expected a state of FMU {self.fmu_guid}, got {came}")
        self._enter(state["phase"])
        self._stale = state["stale"]
        self._refused = {int(reference): str(problem) for reference, problem in state["refused"]}
        self._values[:] = array("d", state["values"])

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        # No instance is at hand here to survive an exception; `_set_fmu_state` refuses what has no GUID.
        try:
            content = json.loads(state.decode("utf-8"))
        except ValueError:
            return {}
        return content if isinstance(content, dict) else {}

    # --- the rest -----------------------------------------------------------------------------------------

    def log_problem(self, problem: str, status: Fmi2Status = Fmi2Status.error, occasion: str = "") -> None:
        """To the host's log, and once to Python's, because hosts often run with their log switched off."""
        self.log(occasion + problem, status)
        if problem != self._last_problem:
            _logger.error("%s: %s%s", self.instance_name, occasion, problem)
            self._last_problem = problem


# No variable is of these types; asked for one, pythonfmu's own methods raise.
for _access in ("get_integer", "get_boolean", "get_string", "set_integer", "set_boolean", "set_string"):
    setattr(DriveSlave, _access, guarded(getattr(Fmi2Slave, _access)))
