"""Tolerance scatter along a record: the covariance by which individual drives' torque differs from the mean drive's.

Which seats the elements occupy, and where the first one stands, no drawing says. A record may show it, but only to
those who know how every element moves: seats that are taken to be known and are not quite right explain an individual
worse than none, and leave to effects what is not theirs. The covariance is therefore that of all individuals, averaged
over what seatings are possible: how alike the torque is at two instants depends on how far the elements have moved
between them, and on which lobes they then face.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from .curve_columns import curve_columns
from .element_columns import SeatedElements, average_torque
from .element_motion import ElementMotion
from .responses import ElementResponses
from .seating import spread_seatings

N_SEATINGS = 12
"""Seatings over which the covariance is averaged. Chosen by the likelihood of records of individuals: 96 change their
-2 log likelihood by less than 25, where 6 lose up to 240."""
PAIRS_EVERY = 3
"""One of so many seatings stands for the products of elements and lobes, which take most of the time. Chosen by the
likelihood of individuals, which the products of all seatings change by less than 40."""


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; motion: of the elements where the contacts have the twist (n,), rad, of a first
    estimate, by block."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    twist: Array

    def covariance_at(self, twist: Array, clearance: Array | float = 0.0, beside: Array | None = None) -> Array:
        """See `ToleranceScatter`."""
        if twist is not self.twist:
            return self._moved(twist, beside).covariance_at(twist, clearance)
        clearance = np.broadcast_to(np.asarray(clearance, float), twist.shape)[self.motion.block]
        parts = self.drive, self.responses, self.motion, twist, clearance
        average = average_torque(*parts)
        found = np.zeros((len(twist), len(twist)))
        for number, seating in enumerate(spread_seatings(self.drive, N_SEATINGS)):
            elements = SeatedElements(*parts, seating)
            columns = elements.columns(average)
            found += columns.T @ columns / N_SEATINGS
            if number % PAIRS_EVERY == 0:
                found += elements.of_pairs() / (N_SEATINGS // PAIRS_EVERY)
        curves = curve_columns(average[0], found)
        return found + curves.T @ curves

    def _moved(self, twist: Array, beside: Array | None) -> Scatter:
        """The scatter with the elements where the contacts have another twist (n,), rad: what effects add to the twist
        between the contacts and the sensors moves no element along the profile."""
        motion = self.motion
        within = 0.0 if beside is None else motion.beside_mean(beside)
        ahead = (self.drive.ratio - 1) * ((self.twist - twist)[motion.block] - within)
        motion = replace(motion, rotation=motion.rotation + ahead, twist=motion.twist + within)
        return replace(self, motion=motion, twist=twist)

    @property
    def clearance_deviation(self) -> float:
        """m, standard deviation of a single element's clearance."""
        return self.responses.deviation
