"""The gear's profile for manufacturing, as a DXF file in mm; needs ezdxf (the extra `dxf`)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ...drawing.drive import HOLES, Drive
from ...drawing.fits import zone_text
from ...errors import InputError, install_command
from ...io.atomic_files import atomic_file
from ...units import MICROMETRE
from .layout import Layout, place_parts, unit_vector
from .outline import CHORD_ERROR, Outline, equidistant, gear_offset, gear_outline, rotated

MILLIMETRES = 4
"""Value of $INSUNITS for millimetres."""
LAYERS = {"PROFILE": 7, "BALL_PATH": 5, "PITCH_CIRCLE": 3, "BORES": 1, "NOTES": 8}
"""Layers and their AutoCAD colours; profile, path and bores of the second row are on PROFILE_2 and so on."""


def write_dxf(drive: Drive, path: str | os.PathLike[str], chord_error: float = CHORD_ERROR) -> Outline:
    """Write profile, ball path, pitch circle and bores of every row, and return the profile as written.

    The profile is a closed polyline, trimmed where it would intersect itself, with a chord error of at most
    `chord_error` m. A bore is drawn as its circle in the plane of the balls and its axis, both with the crank at angle
    0. A further row has a profile of its own only where that is rotated relative to the first. The file is written
    atomically. Raises `InputError` if ezdxf is missing or the folder is not writable.
    """
    try:
        from ezdxf.filemanagement import new
    except ImportError:
        raise InputError(f"dxf: expected the library ezdxf, got none; {install_command('dxf')}") from None
    profile = gear_outline(drive, chord_error)
    centres = equidistant(drive.path, 0.0, chord_error)
    layout = place_parts(drive)
    document: Any = new("R2010", units=MILLIMETRES)
    document.header["$MEASUREMENT"] = 1
    space = document.modelspace()
    for row in range(drive.eccentrics):
        names = {name: name if row == 0 else f"{name}_{row + 1}" for name in ("PROFILE", "BALL_PATH", "BORES")}
        if row == 0 or layout.gear[row] != 0:
            for name, outline in (("PROFILE", profile), ("BALL_PATH", centres)):
                _layer(document, names[name], LAYERS[name])
                space.add_lwpolyline(
                    1e3 * rotated(outline.points, float(layout.gear[row])),
                    close=True,
                    dxfattribs={"layer": names[name]},
                )
        _layer(document, names["BORES"], LAYERS["BORES"])
        _bores(space, drive, layout, row, names["BORES"])
    for name in ("PITCH_CIRCLE", "NOTES"):
        _layer(document, name, LAYERS[name])
    radius = 1e3 * drive.path.centre_distance
    space.add_circle((0, 0), radius, dxfattribs={"layer": "PITCH_CIRCLE"})
    space.add_mtext(
        "\\P".join(notes(drive, profile, layout)),
        dxfattribs={
            "layer": "NOTES",
            "char_height": 0.04 * radius,
            "width": radius,
            "insert": (-radius / 2, radius / 4),
        },
    )
    with atomic_file(path) as temporary:
        document.saveas(temporary)
    return profile


def notes(drive: Drive, profile: Outline, layout: Layout) -> list[str]:
    """Information for manufacturing beside the geometry, one line each."""
    zone, _ = zone_text(drive.tolerances["gear"], drive.size("gear"), "gear" in HOLES)
    lines = [
        f"{drive.name}: {drive.lobes} lobes, ratio {drive.ratio:+g}, all sizes in mm",
        f"profile {1e3 * gear_offset(drive):.6g} outside the path of the centres, middle of the zone "
        f"{zone}; chord error below {profile.error / MICROMETRE:.3g} um",
        f"pitch radius {1e3 * drive.path.centre_distance:.6g}, eccentricity {1e3 * drive.eccentricity:.6g}, "
        f"{drive.element} diameter {2e3 * drive.element_radius:.6g}",
    ]
    if profile.limit < np.pi:
        lines.append(f"lobes meet in a sharp crest, {np.degrees(profile.limit):.3f} deg of 180 from a lobe's middle")
    lines += [
        f"row {row + 1}: profile turned by {np.degrees(turn):+.6f} deg against row 1"
        for row, turn in enumerate(layout.gear)
        if row
    ]
    return lines


def _bores(space: Any, drive: Drive, layout: Layout, row: int, layer: str) -> None:
    centre_distance = 1e3 * drive.path.centre_distance
    radius = 1e3 * (drive.element_radius + drive.tolerances["cage"].offset)
    for direction in unit_vector(layout.bore[row]):
        space.add_circle(centre_distance * direction, radius, dxfattribs={"layer": layer})
        space.add_line(
            (centre_distance - 1.2 * radius) * direction,
            (centre_distance + 1.2 * radius) * direction,
            dxfattribs={"layer": layer},
        )


def _layer(document: Any, name: str, colour: int) -> None:
    document.layers.add(name, color=colour)
