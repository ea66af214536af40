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
from .row import ARROW_COLOURS, colour_elements, colour_map, draw_arrows, draw_row
from .row_outlines import row_outlines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAMES = 24
"""Frames per turn of the crank; chosen by judgement."""
MAX_FRAMES = 720
FRAME_TIME = 100
"""Duration of a frame, ms."""
WIDTH, HEIGHT, DOTS_PER_INCH = 4.6, 5.2, 100
COLOURS, FORCE_COLOURS = 32, 8
"""Of the palette, and those of them for the scale of forces; the size of the file grows with their number."""
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
    first, *further = [_indexed(picture, palette) for picture in pictures]
    with atomic_file(path) as temporary:
        # Optimised: pixels that do not change are left out of a frame.
        first.save(temporary, save_all=True, append_images=further, duration=FRAME_TIME, loop=0, optimize=True)
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
        f"eccentric 1, crank at {np.degrees(crank):.0f} deg, output at {np.degrees(crank / drive.ratio) + 0.0:.1f} deg"
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


def _palette(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """One palette for all frames, (COLOURS, 3), since changing colours would make the seam of the loop visible."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    # Thin lines cover too few pixels for their colours to enter by frequency, and a mean of several is none of them.
    steps = [colour_map()(k / (FORCE_COLOURS - 1)) for k in range(FORCE_COLOURS)]
    named = [to_rgb(colour) for colour in ("white", INK, HAND, *dict.fromkeys(ARROW_COLOURS), *steps)]
    exact = np.round(255 * np.array(named)).astype(np.uint8)
    common = Image.fromarray(picture).quantize(COLOURS - len(named)).getpalette() or []
    return np.concatenate([exact, np.array(common, np.uint8).reshape(-1, 3)])[:COLOURS]


def _indexed(picture: NDArray[np.uint8], palette: NDArray[np.uint8]) -> Any:
    """The picture in the nearest colours of the palette: without dithering, whose pattern would flicker."""
    from PIL import Image

    packed = picture.astype(np.int32) @ np.array([1 << 16, 1 << 8, 1])
    colours, where = np.unique(packed, return_inverse=True)
    parts = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1)
    nearest = ((parts[:, None] - palette.astype(np.int32)) ** 2).sum(axis=-1).argmin(axis=-1).astype(np.uint8)
    image = Image.fromarray(nearest[where].reshape(packed.shape))
    image.putpalette(palette.tobytes())
    return image
