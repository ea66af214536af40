"""Parameters of python-control systems by `<system>.<parameter>`, so that systems in one interconnection share none.

python-control hands all parameters of an interconnection to every system in it: what its systems declare, then what
the caller gives. Two joints that both declared `load.inertia` would both run with the value of the second. So a name
begins with its system's, and:

* A name that begins with the system's own name must be one of its parameters.
* A system that stands alone also takes the names without its own in front, and refuses every other name.
* In an interconnection other names may belong to other systems and are passed over. A name that is this system's but
  for the prefix, and that no system declares, would be lost in silence: it is refused.
* Two systems of one name whose values differ are not interconnected: their parameters could not be told apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import control as ct

from stiffness_model.errors import InputError, expect_number, unknown_name


class CombinedParameters(dict[str, float]):
    """Parameters of an interconnection's systems, as python-control joins them with |, and copies them.

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
    """Parameters of one system; values by names without the system's."""

    def __init__(self, system: str, values: Mapping[str, float]) -> None:
        super().__init__({f"{system}.{name}": value for name, value in values.items()})
        self.system = system
        self.declared: set[str] | None = None
        """Names that the systems of an interconnection declare, once these have come through one."""

    @property
    def unprefixed(self) -> dict[str, float]:
        """Values by names without the system's."""
        return {name[len(self.system) + 1 :]: value for name, value in self.items()}

    def for_system(self, system: str) -> Parameters:
        """The same values, of a system of another name."""
        return Parameters(system, self.unprefixed)

    def copy(self) -> Parameters:  # type: ignore[override]
        return self.for_system(self.system)

    def update(self, other: Mapping[str, Any]) -> None:  # type: ignore[override]
        # In an interconnection a copy is updated twice: by what its systems declare, this one among them, and by what
        # the caller gives, or, where it is a part of another one, by what that one's systems declare.
        self.declared = self.declared or set()
        if self.keys() <= other.keys():
            self.declared |= other.keys()
        super().update(other)

    def updated_with(self, params: Mapping[str, Any] | None) -> Parameters:
        """These parameters with the values that python-control passes on.

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
    """A python-control system whose parameters begin with its name, also where it was copied under another."""

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
