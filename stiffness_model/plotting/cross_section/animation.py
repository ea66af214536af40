"""A turn of the crank as an animated GIF that loops seamlessly."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...drawing import sampling
from ...drawing.drive import Drive
from ...errors import expect
from ...io.atomic_files import atomic_file
from ...units import ARCMIN
from ..style import INK, drive_name
from ..text_fit import text_width
from .element_forces import ElementForces, solve_element_forces
from .layout import period_turns
from .row import ARROW_COLOURS, colour_elements, draw_arrows, draw_row
from .row_outlines import row_outlines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAMES = 48
"""Frames per turn of the crank; chosen by judgement."""
MAX_FRAMES = 720
FRAME_TIME = 60
"""Duration of a frame, ms."""
WIDTH, HEIGHT, DOTS_PER_INCH = 4.6, 5.2, 100
COLOURS = 64
HAND = "#7a4a2f"
"""Colour of the hand that shows the crank's angle."""
PARTS = ("gear", "crank", "cage")


def write_animation(drive: Drive, path: str | os.PathLike[str], twist: float = 0.0, frames: int = FRAMES) -> int:
    """Write the first row of the nominal drive over one period of its motion, and return the number of frames.

    The gear is fixed, the crank turns, and the cage turns by 1/ratio of it. After one turn of the crank every bore is
    where its neighbour was, so the picture repeats (`layout.period_turns`: a row with empty seats needs more turns). At
    a `twist`, rad at the output, the forces are those at every crank angle. frames: per turn. The file is written
    atomically. Raises `InputError` for fewer than 2 frames per turn or more than `MAX_FRAMES` in all.
    """
    count = frames * period_turns(drive)
    expect(
        frames >= 2 and count <= MAX_FRAMES,
        f"at least 2 frames a turn, and at most {MAX_FRAMES} in the {period_turns(drive)} turns of a period",
        frames,
        "frames",
    )
    every = list(forces_over_turn(drive, twist, frames))
    pictures = list(_pictures(drive, every))
    palette = _palette(pictures[0])
    # No dithering: its pattern would flicker.
    first, *further = [_image(picture).quantize(palette=palette, dither=0) for picture in pictures]
    with atomic_file(path) as temporary:
        first.save(temporary, save_all=True, append_images=further, duration=FRAME_TIME, loop=0, optimize=False)
    return count


def forces_over_turn(drive: Drive, twist: float, frames: int = FRAMES) -> Iterator[ElementForces]:
    """Contact forces of the nominal drive over one period of its motion, at `frames` crank angles per turn."""
    nominal = sampling.nominal(drive)
    for k in range(frames * period_turns(drive)):
        yield solve_element_forces(drive, nominal, twist, 2 * np.pi * k / frames)


def _pictures(drive: Drive, every: list[ElementForces]) -> Iterator[NDArray[np.uint8]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    greatest = max(float(forces.significant[0].max()) for forces in every)
    for forces in every:
        figure.clear()
        ax = figure.add_axes((0.01, 0.055, 0.98, 0.85))
        row = row_outlines(drive, forces, 0)
        draw_row(ax, drive, row)
        colour_elements(ax, forces, 0, greatest)
        draw_arrows(ax, drive, forces, 0, greatest)
        # A hand shows the crank's angle, since the eccentricity is too small to see.
        radius, angle = 0.8e3 * drive.crank_radius, forces.layout.crank[0]
        ax.plot([0, radius * np.cos(angle)], [0, radius * np.sin(angle)], color=HAND, linewidth=2.5)
        ax.set_title(_state(drive, forces), loc="left", fontsize="small", color=INK, linespacing=1.4)
        _name_arrows(figure, greatest)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _state(drive: Drive, forces: ElementForces) -> str:
    """Drive, angles of crank and output, and torque of one frame."""
    crank = forces.layout.crank[0]
    load = f"{forces.torque.sum():.4g} N.m at {forces.twist / ARCMIN:g} arcmin" if forces.twist else "no load"
    return (
        f"{drive_name(drive.name)}: {drive.lobes} lobes, ratio {drive.ratio:+g}; {load}\n"
        f"eccentric 1, crank at {np.degrees(crank):.0f} deg, output at {np.degrees(crank / drive.ratio):.1f} deg"
    )


def _name_arrows(figure: Figure, greatest: float) -> None:
    """The colours of the arrows in words, and what the hand is, below the picture."""
    words = [("hand: angle of the crank", HAND)]
    if greatest > 0:
        words += [(f"force of the {name}", colour) for name, colour in zip(PARTS, ARROW_COLOURS, strict=False)]
    left = 0.02
    for word, colour in words:
        figure.text(left, 0.02, word, color=colour, fontsize="x-small")
        left += (text_width(word, "x-small") + 0.14) / WIDTH


def _palette(picture: NDArray[np.uint8]) -> Any:
    """One palette for all frames, since changing colours would make the seam of the loop visible."""
    from matplotlib.colors import to_rgb

    # Thin lines cover too few pixels for their colours to enter the palette by frequency.
    named = [np.uint8(255 * np.array(to_rgb(colour))) for colour in ("white", *ARROW_COLOURS)]
    samples = np.repeat(np.repeat(np.array(named)[:, None], 40, axis=0), picture.shape[1], axis=1)
    return _image(np.concatenate([picture, samples])).quantize(COLOURS)


def _image(picture: NDArray[np.uint8]) -> Any:
    from PIL import Image

    return Image.fromarray(picture)
