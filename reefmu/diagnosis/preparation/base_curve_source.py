"""Where the base curve of a diagnosis comes from."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from stiffness_model.drawing.drive import Drive
from stiffness_model.kinds import AnyDrive
from stiffness_model.lookup.curve_lookup import CurveLookup

from ...model.chosen_effects import inherent_effects
from ...model.contacts.tables import cached_lookup
from ...record import Record
from ..forward.base_curve import BaseCurve, curve_base, drawing_base, lookup_base, power_base, table_base
from ..losses.crank_losses import CRANK_FRICTION
from ..preprocessing.audit import ratio_from_angles
from ..preprocessing.trace import Trace


@dataclass(frozen=True)
class BaseCurveSource:
    """Where the base curve comes from: a drive, a curve file, or a function of the record's traces; a free power law
    if none of them is given."""

    drive: AnyDrive | None = None
    curve: str | os.PathLike[str] | None = None
    make: Callable[[Trace], BaseCurve] | None = None

    def ratio(self, record: Record) -> float | None:
        """Signed transmission ratio of the drawing, else the one that the angles of the record show, if any."""
        return ratio_from_angles(record) if self.drive is None else self.drive.ratio

    def stated_friction(self) -> dict[str, float]:
        """Parameters of the friction at the crank that the drive states, by name; none without it."""
        return {} if self.drive is None else inherent_effects(self.drive).get(CRANK_FRICTION, {})

    def base_curve(self, trace: Trace) -> BaseCurve:
        """The base curve for a record with these traces."""
        if self.make is not None:
            return self.make(trace)
        if isinstance(self.drive, Drive):
            return drawing_base(self.drive, cached_lookup(self.drive))
        if self.drive is not None:
            lookup = cached_lookup(self.drive)
            if isinstance(lookup, CurveLookup):
                return lookup_base(self.drive, lookup)
            return table_base(self.drive, lookup)
        return power_base(trace) if self.curve is None else curve_base(self.curve, trace.ratio)
