"""Bounds on the sizes of an assembled drive, within which the contact model is valid.

All follow from one number, `MAX_CONTACT_RATIO`: Hertz's theory takes both bodies for half-spaces, so a contact must be
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
"""Greatest half width of a contact over the element's radius; chosen by judgement, see above."""
MAX_INDENTATION_RATIO = MAX_CONTACT_RATIO**2
"""Indentation over the element's radius at which a contact is that wide (Johnson, eq. 4.23: d = a^2/R)."""
_NAMES = {
    "element": "element radius",
    "crank": "crank radius",
    "cage": "bore radius",
    "gear": "distance of the gear's profile from the ball path",
}


def check_radii(nominal: Mapping[str, float], tolerances: Mapping[str, Tolerance], where: str) -> None:
    """Raise `InputError` unless every radius, m, by part, is positive in the whole of its tolerance zone.

    where: what precedes the field's name in the message.

    >>> check_radii({"cage": 7e-3}, {"cage": Tolerance(5e-6, -8e-3)}, "drawing: ")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: drawing: cage_offset: expected a bore radius above zero in its whole tolerance \
zone, got 7 mm -8 mm +-1.25 um
    """
    for part, radius in nominal.items():
        tolerance = tolerances[part]
        if not radius + tolerance.offset - tolerance.window / 4 > 0:
            raise InputError(
                f"{where}{part}_offset: expected {_an(_NAMES[part])} above zero in its whole tolerance "
                f"zone, got {_length(radius)} {_signed(tolerance.offset)} "
                f"+-{_length(tolerance.window / 4)}"
            )


def check_flank(path: BallPath, limit: float, element_radius: float, where: str) -> None:
    """Raise `InputError` if the usable part of a lobe is shorter than half the widest contact of an element.

    limit: |beta|, rad, beyond which the profile cuts itself; element_radius: m.
    """
    length = 2 * limit / path.lobes * (path.centre_distance + element_radius)
    shortest = MAX_CONTACT_RATIO * element_radius
    if length < shortest:
        raise InputError(
            f"{where}lobes: expected lobes that are at least {_length(shortest)} long, half the widest "
            f"contact of such an element, got {path.lobes} lobes of {_length(length)}, whose profile "
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
    """Raise `InputError` if the mean drive indents its elements beyond Hertz's theory, or lets them pass the lobes.

    element_radius: m; compliance: indentation of the contacts at "gear" and "crank" under one force, in any unit.
    Without load an element between crank and gear shares its interference between both contacts in proportion to
    their compliances; in its bore either wall takes the whole interference. With a play of 2 e the elements clear the
    lobes and the crank turns freely; with a bore wider by half a pitch an element can slip into the next lobe.
    """
    max_indentation = MAX_INDENTATION_RATIO * element_radius
    offset = {part: tolerance.offset for part, tolerance in tolerances.items()}
    interference = 2 * offset["element"] + offset["crank"] - offset["gear"]
    share = max(compliance["gear"], compliance["crank"]) / (compliance["gear"] + compliance["crank"])
    reason = (
        f"Hertz's theory ends at an indentation of {_length(max_indentation)} at one contact, a hundredth of the "
        "element's radius"
    )
    if share * interference > max_indentation:
        raise InputError(
            f"{where}gear_offset: expected mean offsets by which crank and gear compress an element by less "
            f"than {_length(max_indentation / share)} without load, got {_length(interference)}; {reason}"
        )
    if -interference >= 2 * path.eccentricity:
        raise InputError(
            f"{where}gear_offset: expected mean offsets with a play at the gear below twice the "
            f"eccentricity, {_length(2 * path.eccentricity)}, got {_length(-interference)}, at which "
            "the elements clear the lobes"
        )
    clearance = offset["cage"] - offset["element"]
    if -clearance > max_indentation:
        raise InputError(
            f"{where}cage_offset: expected bores that indent an element by less than {_length(max_indentation)} on "
            f"either side, got {_length(-clearance)}; {reason}"
        )
    half_pitch = math.pi / path.lobes * path.centre_distance
    if clearance >= half_pitch:
        raise InputError(
            f"{where}cage_offset: expected a clearance in the bore below half the lobes' pitch, "
            f"{_length(half_pitch)}, got {_length(clearance)}, at which an element slips into the next "
            "lobe"
        )


def _length(value: float) -> str:
    return f"{1e3 * value:.4g} mm" if abs(value) >= 1e-4 else f"{1e6 * value:.4g} um"


def _signed(value: float) -> str:
    return _length(value) if value < 0 else f"+{_length(value)}"


def _an(name: str) -> str:
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
