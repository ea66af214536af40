"""The variables of an FMU and their interface, from which the back ends and the XML are made.

The value reference of a variable is its position in the interface. The variables are ordered in blocks: inputs,
outputs, parameters, states and, for model exchange, the derivatives of the states. A back end can therefore keep all
of them in one array and pass a slice of it as a vector of the model.
"""

from __future__ import annotations

import hashlib
import math
import sys
from dataclasses import dataclass
from typing import Literal

from stiffness_model.errors import unknown_name

Causality = Literal["input", "output", "parameter", "local"]
Variability = Literal["continuous", "discrete", "tunable", "fixed"]
BLOCKS: tuple[Causality, ...] = ("input", "output", "parameter", "local")
"""Order of the blocks; the states are the `local` variables that are not derivatives."""


@dataclass(frozen=True)
class FmiVersion:
    """A version of FMI. first_reference: the value reference of the first declared variable."""

    version: str
    first_reference: int


FMI2, FMI3 = FmiVersion("2.0", 0), FmiVersion("3.0", 1)
"""Value references start at 1 in FMI 3.0 because OMSimulator takes them for positions in the list, counted from one."""
INDICATOR_PREFIX = "indicator."
"""Prefix of the names of event indicators in FMI 3.0."""
FMI_VERSIONS = {standard.version: standard for standard in (FMI2, FMI3)}


@dataclass(frozen=True)
class Variable:
    """One Real variable (FMI 2.0.4, section 2.2.7). An attribute that is None is left out of the XML.

    dependencies: the inputs, and with derivatives also the states, on which an output or derivative depends
    (section 2.2.8); initial_dependencies: the inputs and parameters on which an unknown depends at initialisation;
    derivative_of: name of the state whose derivative this is; reinit: whether a state may jump at an event.
    """

    reference: int
    name: str
    causality: Causality
    variability: Variability
    unit: str
    description: str
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    dependencies: tuple[str, ...] = ()
    initial_dependencies: tuple[str, ...] = ()
    derivative_of: str = ""
    reinit: bool = False

    @property
    def initial(self) -> str | None:
        """The attribute `initial` (section 2.2.7): parameters are exact, results are calculated."""
        return {"input": None, "parameter": "exact"}.get(self.causality, "calculated")

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and greatest admissible value: min and max where declared, never infinite."""
        return (
            -sys.float_info.max if self.minimum is None else self.minimum,
            sys.float_info.max if self.maximum is None else self.maximum,
        )

    def range_error(self, value: float) -> str:
        """One line that says why `value` is not admissible."""
        if not math.isfinite(value):
            return f"{self.name}: expected a finite number [{self.unit}], got {value}"
        low, high = self.limits
        return f"{self.name}: expected a number from {low:g} to {high:g} [{self.unit}], got {value:g}"


@dataclass(frozen=True)
class Interface:
    """The variables of one FMU, in the order of their value references."""

    kind: str
    name: str
    variables: tuple[Variable, ...]

    def block(self, causality: Causality) -> tuple[Variable, ...]:
        """The variables of one block, in the order of the model's vector; derivatives excluded."""
        return tuple(v for v in self.variables if v.causality == causality and not v.derivative_of)

    @property
    def derivatives(self) -> tuple[Variable, ...]:
        """The derivatives of the states, which only an FMU for model exchange declares."""
        return tuple(v for v in self.variables if v.derivative_of)

    def span(self, causality: Causality) -> slice:
        """The slice of all value references that a block occupies."""
        references = [v.reference for v in self.block(causality)]
        return slice(references[0], references[-1] + 1) if references else slice(0, 0)

    def __getitem__(self, name: str) -> Variable:
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise unknown_name("FMU variable", name, (v.name for v in self.variables))

    @property
    def digest(self) -> str:
        """Hash of kind, references, names, causalities and units, on which an FMU and its importer must agree."""
        layout = [(v.reference, v.name, v.causality, v.unit) for v in self.variables]
        return hashlib.sha256(repr((self.kind, layout)).encode()).hexdigest()[:16]
