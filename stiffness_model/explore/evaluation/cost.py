"""The cost class of a drawing: how fine its machined tolerances are."""

from __future__ import annotations

import math
from itertools import pairwise

from ...drawing.drive import Drive
from ...drawing.tolerances import iso_286

COARSEST = 12
"""The IT grade that costs nothing: what turning, milling and printing give without care."""
_MADE = ("gear", "cage")
"""Parts machined for the drive. Balls and bearings are bought, whatever their class."""


def cost_class(drive: Drive) -> float:
    """Grades of ISO 286 by which the windows of gear and cage are finer than IT12, summed.

    One grade is a window narrower by a factor of about 1.6; published cost-tolerance relations (Abdel-Malek and
    Asadathorn, the paper's [28]) rise by a like factor per grade, so the sum orders drawings and is no currency.
    Windows between two grades count in between, by the logarithm of their width.

    >>> from stiffness_model import load_drive
    >>> [round(cost_class(load_drive(name)), 2) for name in ("drive_1", "drive_2", "drive_3")]
    [15.0, 9.0, 1.0]
    """
    return sum(max(0.0, COARSEST - grade(drive.tolerances[part].window, drive.size(part))) for part in _MADE)


def grade(window: float, size: float) -> float:
    """The IT grade of a window, m, at a nominal size, m, as a number between the grades; 1 for finer than IT1.

    >>> round(grade(87e-6, 96e-3), 3), round(grade(50e-6, 96e-3), 1)
    (9.0, 7.8)
    """
    logs = [math.log(iso_286(g, size)) for g in range(1, COARSEST + 1)]
    wanted = math.log(max(window, 1e-12))
    for g, (fine, coarse) in enumerate(pairwise(logs), start=1):
        if wanted <= coarse:
            return g + max(0.0, (wanted - fine) / (coarse - fine))
    return float(COARSEST)
