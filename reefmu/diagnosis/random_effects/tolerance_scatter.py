"""What fits need to know of the scatter of a population along one record, whatever the kind of drive."""

from __future__ import annotations

from typing import Protocol

from stiffness_model.numerics.arrays import Array


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
    def crank_stands(self) -> bool:
        """Whether the same contacts carry the load throughout: the curve of an individual is then smooth."""
        ...

    def columns_at(
        self, twist: Array, clearance: Array | float = 0.0, beside: Array | None = None
    ) -> tuple[Array, Array]:
        """Columns (m, n), N.m, of one standard deviation of each random effect, and the variances (r, n), (N.m)^2,
        that they may not span, by roughness.

        twist: (n,) rad, at the contacts; clearance: (n,) m, beyond the drawn one; beside: rad, at all samples of the
        record, what effects add to the twist of the contacts beyond that of the sensors, nothing if None.
        """
        ...
