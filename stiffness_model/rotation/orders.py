"""Order spectra of signals that are periodic in the output's turn.

An order is the number of waves in a turn of the output; divided by |i| it is that in a turn of the crank. Deviations
are identified by their order: equal lobes leave multiples of z (each wave is an element's path from lobe to lobe),
equal elements leave multiples of the elements on an eccentric, and orders common to both come from the passing
elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..display import one_line
from ..drawing.drive import Drive
from ..errors import expect
from ..numerics.arrays import Array


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes (n,) of the orders 0, 1, ... n - 1 per turn of the output; the amplitude of order 0 is the mean.

    The mean square is amplitude[0]^2 + sum(amplitude[1:]^2)/2 (Parseval). phase: (n,) rad, of cosines.
    """

    drive: Drive
    amplitude: Array
    phase: Array

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def order(self) -> NDArray[np.intp]:
        """Waves in a turn of the output, (n,)."""
        return np.arange(len(self.amplitude))

    @property
    def crank_order(self) -> Array:
        """Waves in a turn of the crank, (n,)."""
        return self.order / self.drive.transmission_ratio

    @property
    def ripple(self) -> float:
        """Root mean square without the mean."""
        return float(np.sqrt((self.amplitude[1:] ** 2).sum() / 2))

    def strongest(self, count: int) -> list[int]:
        """The orders per turn of the output with the largest amplitudes, in descending order, without the mean."""
        return [int(k) + 1 for k in np.argsort(-self.amplitude[1:], kind="stable")[:count]]

    def source(self, order: int) -> str:
        """Possible origin of an order per turn of the output.

        "passing": the passing elements, present without deviations; "elements": deviations of balls, bores and
        raceways, with equal lobes; "lobes": deviations of lobes, with equal elements; "rows": either of them, or of a
        row (its eccentric) as a whole; "both": only lobes and elements together.
        """
        drive = self.drive
        of_elements = order % drive.lobes == 0
        evenly = round(drive.transmission_ratio) % drive.elements_per_row == 0
        of_lobes = evenly and order % drive.elements_per_row == 0
        if of_elements and order % (drive.lobes * drive.elements) == 0:
            return "passing"
        return {(True, True): "rows", (True, False): "elements", (False, True): "lobes", (False, False): "both"}[
            of_elements, of_lobes
        ]


def spectrum(drive: Drive, values: ArrayLike) -> Spectrum:
    """Spectrum over one turn of the output.

    drive: gives the orders per turn of the crank. values: (n,) in any unit, at n angles spread evenly over the turn
    from 0 (`individual_drive.angles_over_turn`).

    >>> from stiffness_model import load_drive
    >>> wave = 2 + 3 * np.cos(5 * 2 * np.pi * np.arange(64) / 64)
    >>> found = spectrum(load_drive("drive_1"), wave)
    >>> found.strongest(1), found.amplitude[[0, 5]].round(6), found.crank_order[29]
    ([5], array([2., 3.]), np.float64(1.0))
    """
    signal = np.asarray(values, float)
    expect(
        signal.ndim == 1 and len(signal) > 2 and bool(np.isfinite(signal).all()),
        "finite values over one turn, (n,)",
        np.shape(values),
        "values",
    )
    n = len(signal)
    transform = np.fft.rfft(signal) / n
    amplitude = 2 * np.abs(transform)
    amplitude[0] = transform[0].real
    if n % 2 == 0:
        # The highest order has a cosine only, sampled at its extremes: its mean square is its amplitude squared, not
        # half.
        amplitude[-1] *= np.sqrt(2) / 2
    return Spectrum(drive, amplitude, np.angle(transform))
