"""What every drawing must keep so that the contact model can speak of it: the bounds of an assembled drive's sizes.

One number, `MAX_CONTACT_RATIO`, is behind them: Hertz's theory takes both bodies for half-spaces, so a contact must be
small against the radii (Johnson, Contact Mechanics, section 4.1: a << R). At a tenth, the indentation of a sphere on a
plane is a^2/R, a hundredth of its radius, and the pressure 2 E* a/(pi R) is 7.3 GPa for steel on steel: no bearing
steel withstands that (ISO 76 allows 4.2 GPa), and no elastic model describes what follows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..errors import InputError
from ..geometry.ball_path import BallPath
from .tolerances import Tolerance

MAX_CONTACT_RATIO = 0.1
"""Greatest half width of a contact, as a share of the element's radius."""
MAX_INDENTATION_RATIO = MAX_CONTACT_RATIO**2
"""The indentation that makes a contact so wide, as a share of the element's radius (Johnson, eq. 4.23: d = a^2/R)."""
_NAMES = {
    "element": "element radius",
    "crank": "crank radius",
    "cage": "bore radius",
    "gear": "gear profile's distance",
}


def check_radii(nominal: Mapping[str, float], tolerances: Mapping[str, Tolerance], where: str) -> None:
    """Raise `InputError` unless every radius, m, is above zero all over its tolerance field.

    >>> check_radii({"cage": 7e-3}, {"cage": Tolerance(5e-6, -8e-3)}, "drawing: ")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: drawing: cage_offset: expected a bore radius above zero all over its tolerance \
field, got 7 mm -8 mm +-1.25 um
    """
    for part, radius in nominal.items():
        tolerance = tolerances[part]
        if not radius + tolerance.offset - tolerance.window / 4 > 0:
            raise InputError(
                f"{where}{part}_offset: expected {_an(_NAMES[part])} above zero all over its tolerance "
                f"field, got {_length(radius)} {_signed(tolerance.offset)} "
                f"+-{_length(tolerance.window / 4)}"
            )


def check_flank(path: BallPath, limit: float, element_radius: float, where: str) -> None:
    """Raise `InputError` where a lobe as far as it exists, |beta| up to `limit` rad, is shorter than half a contact."""
    length = 2 * limit / path.lobes * (path.centre_distance + element_radius)
    least = MAX_CONTACT_RATIO * element_radius
    if length < least:
        raise InputError(
            f"{where}lobes: expected lobes that are at least {_length(least)} long, half the widest "
            f"contact of such an element, got {path.lobes} lobes of {_length(length)}, for their profile "
            f"cuts itself {math.degrees(limit):.1f} deg of 180 from a lobe's middle; take fewer lobes, "
            "smaller elements or a smaller eccentricity"
        )


def check_mesh(
    path: BallPath,
    element_radius: float,
    tolerances: Mapping[str, Tolerance],
    compliance: Mapping[str, float],
    where: str,
) -> None:
    """Raise `InputError` where the mean drive presses its elements deeper than the theory reaches, or lets them pass.

    Without load an element between crank and gear shares its interference among both contacts, by their `compliance`,
    the indentations under one force; in its bore it has a whole wall's on either side. With a play of 2 e the elements
    clear the lobes and the crank turns freely; with a bore wider by half a pitch an element slips into the next lobe.
    """
    most = MAX_INDENTATION_RATIO * element_radius
    offset = {part: tolerance.offset for part, tolerance in tolerances.items()}
    interference = 2 * offset["element"] + offset["crank"] - offset["gear"]
    share = max(compliance["gear"], compliance["crank"]) / (compliance["gear"] + compliance["crank"])
    reason = f"{_length(most)} a contact, a hundredth of the element's radius, which Hertz's theory does not reach"
    if share * interference > most:
        raise InputError(
            f"{where}gear_offset: expected mean offsets by which crank and gear press an element by less "
            f"than {_length(most / share)} without load, got {_length(interference)}; beyond it is more "
            f"than {reason}"
        )
    if -interference >= 2 * path.eccentricity:
        raise InputError(
            f"{where}gear_offset: expected mean offsets with a play at the gear below twice the "
            f"eccentricity, {_length(2 * path.eccentricity)}, got {_length(-interference)}, with which "
            "the elements clear the lobes"
        )
    clearance = offset["cage"] - offset["element"]
    if -clearance > most:
        raise InputError(
            f"{where}cage_offset: expected bores that press an element by less than {_length(most)} on "
            f"either side, got {_length(-clearance)}; beyond it is more than {reason}"
        )
    half_pitch = math.pi / path.lobes * path.centre_distance
    if clearance >= half_pitch:
        raise InputError(
            f"{where}cage_offset: expected a clearance in the bore below half the lobes' pitch, "
            f"{_length(half_pitch)}, got {_length(clearance)}, with which an element slips to the next "
            "lobe"
        )


def _length(value: float) -> str:
    return f"{1e3 * value:.4g} mm" if abs(value) >= 1e-4 else f"{1e6 * value:.4g} um"


def _signed(value: float) -> str:
    return _length(value) if value < 0 else f"+{_length(value)}"


def _an(name: str) -> str:
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
