"""Positions of all fitted parameters in one vector: names to slices, and a vector to values by name."""

from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import Parameter, find_effect

ZERO, DELAY = 0, 1
"""Indices of the parameters of the rig: the zero of the twist, rad, and the time, s, by which the torque is read later
than the angles."""
N_RIG = 2
"""Number of the parameters of the rig."""


@dataclass(frozen=True)
class ParameterLayout:
    """Layout of the vector of a fit: what the rig adds, shape of the base curve, parameters of the effects.

    n_shape: number of shape parameters; names: effects in the order of the vector, where one may stand several times.

    >>> layout = ParameterLayout(2, ("backlash", "creep"))
    >>> layout.shape, layout.effects["creep"], layout.size
    (slice(2, 4, None), slice(5, 7, None), 7)
    >>> layout.by_effect(np.arange(7.0))["creep"]
    {'compliance': 5.0, 'time': 6.0}
    """

    n_shape: int
    names: tuple[str, ...]

    @property
    def shape(self) -> slice:
        """The shape of the base curve, after the parameters of the rig."""
        return slice(N_RIG, self.n_base)

    @property
    def n_base(self) -> int:
        """Number of parameters that every set of effects has: those of the rig and of the base curve."""
        return N_RIG + self.n_shape

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """The parameters of the effects, in the order of their names."""
        ends = self.n_base + np.cumsum([0, *(len(find_effect(name).parameters) for name in self.names)])
        return tuple(slice(int(first), int(last)) for first, last in itertools.pairwise(ends))

    @cached_property
    def effects(self) -> dict[str, slice]:
        """The parameters of every effect, the last of those with one name."""
        return dict(zip(self.names, self.slices, strict=True))

    @property
    def size(self) -> int:
        """Length of the vector."""
        return self.n_base + sum(len(find_effect(name).parameters) for name in self.names)

    def effect_parameters(self) -> list[tuple[int, Parameter]]:
        """Index and declaration of the parameters of all effects, in the order of the vector."""
        return [
            (self.effects[name].start + k, p) for name in self.names for k, p in enumerate(find_effect(name).parameters)
        ]

    def by_effect(self, vector: Array) -> dict[str, dict[str, float]]:
        """Values of the effects' parameters in a vector (size,), by effect and parameter."""
        return {
            name: {p.name: float(v) for p, v in zip(find_effect(name).parameters, vector[where], strict=True)}
            for name, where in self.effects.items()
        }

    def restrict(self, names: Collection[str], vector: Array) -> tuple[ParameterLayout, Array]:
        """The layout of those effects that are in `names`, in the same order, and their part of a vector (size,)."""
        kept = tuple(name for name in self.names if name in names)
        parts = [vector[: self.n_base], *(vector[self.effects[name]] for name in kept)]
        return ParameterLayout(self.n_shape, kept), np.concatenate(parts)
