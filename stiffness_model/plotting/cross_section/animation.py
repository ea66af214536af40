"""A turn of the crank as an animated GIF that loops without a seam."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...drawing import sampling
from ...drawing.drive import Drive
from ...errors import expect
from ...io.atomic_files import atomic_file
from ..style import caption
from .element_forces import ElementForces, solve_element_forces
from .layout import period_turns
from .row import ARROW_COLOURS, colour_elements, draw_arrows, draw_row
from .row_outlines import row_outlines

FRAMES = 48
"""Pictures for one turn of the crank."""
MAX_FRAMES = 720
FRAME_TIME = 60
"""ms."""
SIZE, DOTS_PER_INCH = 4.6, 100
COLOURS = 64


def write_animation(drive: Drive, path: str | os.PathLike[str], twist: float = 0.0, frames: int = FRAMES) -> int:
    """Write the first row of the nominal drive through one period of its motion and return the number of pictures.

    The gear is fixed, the crank turns, and the cage by 1/ratio of it. After one turn every bore stands where its
    neighbour stood, and the picture is the same (`layout.period_turns`: a row with empty places needs more turns).
    With a `twist`, rad at the output, forces are drawn as they are at every crank angle. frames: for one turn.
    The file is written whole or not at all. Raises `InputError` for less than 2 frames or more than `MAX_FRAMES`
    in all.
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
    # No dithering: its dots would crawl.
    first, *further = [_image(picture).quantize(palette=palette, dither=0) for picture in pictures]
    with atomic_file(path) as temporary:
        first.save(temporary, save_all=True, append_images=further, duration=FRAME_TIME, loop=0, optimize=False)
    return count


def forces_over_turn(drive: Drive, twist: float, frames: int = FRAMES) -> Iterator[ElementForces]:
    """The nominal drive through one period of its motion, `frames` crank angles a turn."""
    nominal = sampling.nominal(drive)
    for k in range(frames * period_turns(drive)):
        yield solve_element_forces(drive, nominal, twist, 2 * np.pi * k / frames)


def _pictures(drive: Drive, every: list[ElementForces]) -> Iterator[NDArray[np.uint8]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(SIZE, SIZE), dpi=DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    greatest = max(float(loads.significant[0].max()) for loads in every)
    for loads in every:
        figure.clear()
        ax = figure.add_axes((0.01, 0.01, 0.98, 0.93))
        row = row_outlines(drive, loads, 0)
        draw_row(ax, drive, row)
        colour_elements(ax, loads, 0, greatest)
        draw_arrows(ax, drive, loads, 0, greatest)
        # The eccentricity is too small to see the crank turn by.
        radius, angle = 0.8e3 * drive.crank_radius, loads.layout.crank[0]
        ax.plot([0, radius * np.cos(angle)], [0, radius * np.sin(angle)], color="#7a4a2f", linewidth=2.5)
        caption(ax, f"{drive.name}: {drive.lobes} lobes, ratio {drive.ratio:+g}")
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _palette(picture: NDArray[np.uint8]) -> Any:
    """One palette for all frames: colours that flicker would give the loop away."""
    from matplotlib.colors import to_rgb

    # The colours of thin lines cover too little of the picture to be kept by their share of it.
    named = [np.uint8(255 * np.array(to_rgb(colour))) for colour in ("white", *ARROW_COLOURS)]
    samples = np.repeat(np.repeat(np.array(named)[:, None], 40, axis=0), picture.shape[1], axis=1)
    return _image(np.concatenate([picture, samples])).quantize(COLOURS)


def _image(picture: NDArray[np.uint8]) -> Any:
    from PIL import Image

    return Image.fromarray(picture)
