"""What fits need to know of the scatter of a population along one record, whatever the kind of drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol, TypeVar

from stiffness_model.numerics.arrays import Array

Job = TypeVar("Job")
Result = TypeVar("Result")
ClearanceSlope = Callable[[Array, Array], Array]
"""Derivative (k,), N.m/m, of a base curve by the clearance, at twists (k,), rad, and clearances (k,), m."""


class Spread(Protocol):
    """Calls a function for every job, in this process or in others, and gives the results in the order of the jobs."""

    def __call__(self, function: Callable[[Job], Result], jobs: Iterable[Job], /) -> Iterable[Result]: ...


def in_turn(function: Callable[[Job], Result], jobs: Iterable[Job], /) -> Iterable[Result]:
    """One job after the other in this process."""
    return map(function, jobs)


class ToleranceScatter(Protocol):
    """The scatter of individual drives along one record of n blocks."""

    @property
    def twist(self) -> Array:
        """(n,) rad, first estimate of the twist at the contacts."""
        ...

    @property
    def clearance_deviation(self) -> float:
        """m, standard deviation of a clearance, the unit of changes that alter the scatter."""
        ...

    @property
    def mean_clearance_deviation(self) -> float:
        """m, standard deviation of the mean clearance of a drive."""
        ...

    def covariance_at(
        self, twist: Array, clearance: Array | float = 0.0, beside: Array | None = None, spread: Spread = in_turn
    ) -> Array:
        """(n, n) (N.m)^2, covariance of the torque of individual drives less that of the mean drive.

        twist: (n,) rad, at the contacts; clearance: (n,) m, beyond the drawn one; beside: rad, at all samples of the
        record, what effects add to the twist of the contacts beyond that of the sensors, nothing if None; spread:
        shares the work among processes, with the same result.
        """
        ...
