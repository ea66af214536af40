"""The cost class of a drawing: how fine its machined tolerances are."""

from __future__ import annotations

import math
from itertools import pairwise

from ...drawing.drive import Drive
from ...drawing.tolerances import iso_286

COARSEST = 12
"""The IT grade without extra cost, of ordinary turning, milling and printing; chosen by judgement."""
_MACHINED = ("gear", "cage")
"""Parts machined for the drive. Balls and bearings are bought parts, whose class is not counted."""


def cost_class(drive: Drive) -> float:
    """Grades of ISO 286 by which the windows of gear and cage are finer than IT12, summed.

    A finer grade narrows the window by a factor of about 1.6; published cost-tolerance relations (Abdel-Malek and
    Asadathorn, the paper's [28]) rise by a similar factor per grade. So the sum ranks drawings; it is no amount of
    money. Windows between two grades are interpolated by the logarithm of their width.

    >>> from stiffness_model import load_drive
    >>> [round(cost_class(load_drive(name)), 2) for name in ("drive_1", "drive_2", "drive_3")]
    [15.0, 9.0, 1.0]
    """
    return sum(max(0.0, COARSEST - grade(drive.tolerances[part].window, drive.size(part))) for part in _MACHINED)


def grade(window: float, size: float) -> float:
    """The IT grade of a window, m, at a nominal size, m, interpolated; 1 for windows finer than IT1.

    Raises `InputError` for sizes beyond ISO 286.

    >>> round(grade(87e-6, 96e-3), 3), round(grade(50e-6, 96e-3), 1)
    (9.0, 7.8)
    """
    logs = [math.log(iso_286(g, size)) for g in range(1, COARSEST + 1)]
    wanted = math.log(max(window, 1e-12))
    for g, (fine, coarse) in enumerate(pairwise(logs), start=1):
        if wanted <= coarse:
            return g + max(0.0, (wanted - fine) / (coarse - fine))
    return float(COARSEST)
