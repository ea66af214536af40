"""Parameters of python-control systems as `<system>.<parameter>`, so that systems in an interconnection share none.

python-control passes all parameters of an interconnection to every system in it: those that its systems declare, then
those that the caller gives. Two joints that both declare `load.inertia` would both run with the value of the second.
Therefore a name begins with the name of its system:

* A name with the system's prefix must be one of its parameters.
* A system by itself also accepts names without the prefix, and refuses all others.
* In an interconnection other names may belong to other systems and are ignored. A name that is a parameter of this
  system without its prefix, and that no system declares, would have no effect: it is refused.
* Two systems of the same name with different values cannot be interconnected, since their parameters would be
  indistinguishable.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import control as ct

from stiffness_model.errors import InputError, expect_number, unknown_name


class CombinedParameters(dict[str, float]):
    """Parameters of the systems of an interconnection, which python-control joins with | and copies.

    >>> left, right = Parameters("a", {"band": 0.0}), Parameters("b", {"band": 1.0})
    >>> {} | left | right
    {'a.band': 0.0, 'b.band': 1.0}
    >>> {} | left | Parameters("a", {"band": 1.0})
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: a.band: expected systems of different names, got two called 'a'; give each ...
    """

    def copy(self) -> Self:
        return type(self)(self)

    def __or__(self, other: Any) -> Any:
        clashes = self.keys() & other.keys() if isinstance(other, CombinedParameters) else ()
        for name in clashes:
            if self[name] != other[name]:
                system = name.split(".")[0]
                raise InputError(
                    f"{name}: expected systems of different names, got two called {system!r}; give each "
                    'one of its own, as in joint_system(joint, name="left")'
                )
        return CombinedParameters({**self, **other})

    def __ror__(self, other: Any) -> Any:
        return CombinedParameters({**other, **self})


class Parameters(CombinedParameters):
    """Parameters of one system. values: by names without the prefix."""

    def __init__(self, system: str, values: Mapping[str, float]) -> None:
        super().__init__({f"{system}.{name}": value for name, value in values.items()})
        self.system = system
        self.declared: set[str] | None = None
        """Names that the systems of an interconnection declare; None outside of an interconnection."""

    @property
    def unprefixed(self) -> dict[str, float]:
        """Values by names without the prefix."""
        return {name[len(self.system) + 1 :]: value for name, value in self.items()}

    def for_system(self, system: str) -> Parameters:
        """The same values for a system of another name."""
        return Parameters(system, self.unprefixed)

    def copy(self) -> Parameters:  # type: ignore[override]
        return self.for_system(self.system)

    def update(self, other: Mapping[str, Any]) -> None:  # type: ignore[override]
        # In an interconnection a copy is updated twice: by the parameters that its systems declare, these included, and
        # by those of the caller or, if it is part of another interconnection, of that one's systems.
        self.declared = self.declared or set()
        if self.keys() <= other.keys():
            self.declared |= other.keys()
        super().update(other)

    def updated_with(self, params: Mapping[str, Any] | None) -> Parameters:
        """These parameters with the values that python-control passes to the system.

        Raises `UnknownNameError` by the rules of the module, `InputError` for a value that is no finite number.
        """
        values, result = self.unprefixed, self.copy()
        others = params.declared if isinstance(params, Parameters) else None
        for name, value in (params or {}).items():
            own = name.startswith(f"{self.system}.")
            if name in self:
                result[name] = expect_number(value, "a finite number", name)
            elif not own and others is not None:
                if name in values and name not in others:
                    raise unknown_name("parameter", name, [f"{self.system}.{name}"], "interconnection")
            elif not own and name in values:
                result[f"{self.system}.{name}"] = expect_number(value, "a finite number", name)
            elif self:
                raise unknown_name("parameter", name, self if own else values, self.system)
            else:
                raise InputError(f"{self.system}: expected no parameters, got {name!r}")
        return result


class NamedSystem(ct.NonlinearIOSystem):
    """A python-control system whose parameters have its name as prefix, also after a copy under another name."""

    def __init__(self, *args: Any, name: str, params: Mapping[str, float] | None = None, **kwargs: Any) -> None:
        super().__init__(*args, name=name, params=Parameters(name, params or {}), **kwargs)

    @property
    def params(self) -> Parameters:
        """Names and values of the parameters."""
        if self._params.system != self.name:
            self._params = self._params.for_system(str(self.name))
        return self._params

    @params.setter
    def params(self, values: Parameters) -> None:
        self._params = values

    def _update_params(self, params: Mapping[str, Any] | None) -> None:
        # python-control calls this before a simulation, a linearisation or an evaluation.
        self._current_params = self.params.updated_with(params)
