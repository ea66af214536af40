"""The animated GIF of a turn: its frames, its loop, its size."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

import stiffness_model as sm
from stiffness_model.errors import InputError
from stiffness_model.plotting.cross_section.animation import FRAMES, HAND, forces_over_turn, write_animation
from stiffness_model.plotting.cross_section.outline import gear_outline
from stiffness_model.plotting.cross_section.row import ARROW_COLOURS
from tests.unit.stiffness_model.plotting.cross_section.polygons import distances


def pictures(path: Path) -> list[np.ndarray]:
    with Image.open(path) as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            found.append(np.asarray(image.convert("RGB"), int))
        return found


def test_balls_touch_the_profile_in_all_frames(roomy: sm.Drive) -> None:
    """Unloaded and without deviations there is no gap to the profile's outline in any frame."""
    outline = gear_outline(roomy, 1e-6).points
    states = list(forces_over_turn(roomy, 0.0))
    assert len(states) == FRAMES
    for forces in states[::6]:
        gap = distances(forces.layout.centre[0], outline) - roomy.element_radius
        assert np.abs(gap[forces.usable[0]]).max() < 1.01e-6
        assert gap.min() > -1.01e-6
        assert np.abs(forces.displacement[forces.usable]).max() < 1e-12


@pytest.mark.slow
def test_gif_loops_seamlessly(roomy: sm.Drive, tmp_path: Path) -> None:
    """The step from the last frame to the first is like any other, although the cage keeps turning in one direction."""
    small = replace(roomy, eccentrics=1, elements=29)
    assert write_animation(small, tmp_path / "turn.gif", small.max_twist, frames=12) == 12
    with Image.open(tmp_path / "turn.gif") as image:
        assert image.format == "GIF"
        assert image.n_frames == 12
        assert image.info["loop"] == 0
    found = pictures(tmp_path / "turn.gif")
    steps = [np.abs(a - b).mean() for a, b in zip(found, found[1:] + found[:1], strict=True)]
    assert min(steps) > 1
    assert steps[-1] == pytest.approx(np.mean(steps[:-1]), rel=0.15)
    assert (tmp_path / "turn.gif").stat().st_size * FRAMES / 12 < 4e5
    # Thin arrows and the background keep their colours.
    for colour in ("white", HAND, *ARROW_COLOURS):
        wanted = np.round(255 * np.array(to_rgb(colour)))
        assert (found[0] == wanted).all(axis=-1).sum() > 20, colour


def test_frames_are_bounded(tmp_path: Path) -> None:
    sparse = sm.load_drive("drive_1", elements=3 * 20)
    with pytest.raises(InputError, match="at most 720 in the 29 turns"):
        write_animation(sparse, tmp_path / "turn.gif", frames=30)
    with pytest.raises(InputError, match="at least 2 frames"):
        write_animation(sm.load_drive("drive_1"), tmp_path / "turn.gif", frames=1)
    assert not list(tmp_path.iterdir())
