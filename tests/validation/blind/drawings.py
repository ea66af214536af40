"""The drawings of the cases: the three presets with 30 and 28 lobes, and variations of them."""

from __future__ import annotations

import functools
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import stiffness_model as sm


@dataclass(frozen=True)
class Drawing:
    """The fields in which the drawings differ: lengths in mm, grades of ISO 286."""

    preset: str
    lobes: int = 30
    ratio: int = 29
    elements: int = 87
    element_radius: float = 7.0
    crank_radius: float = 41.0
    eccentricity: float = 0.7
    plastic: bool = False
    crank_tolerance: str = "13 um"
    cage_grade: int = 4
    gear_grade: int = 5
    crank_deviation: str = "element"
    max_twist: float = 8.0  # arcmin at the output

    @property
    def toml(self) -> str:
        """The text of the drawing, which the diagnosis reads."""
        soft = "PLA" if self.plastic else "100Cr6"
        return f"""name = "drive"

[geometry]
element = "ball"
element_radius = "{self.element_radius:g} mm"
elements = {self.elements}
eccentrics = 3
crank_radius = "{self.crank_radius:g} mm"
eccentricity = "{self.eccentricity:g} mm"
transmission_ratio = {self.ratio}
lobes = {self.lobes}

[materials]
element_material = "100Cr6"
crank_material = "100Cr6"
cage_material = "{soft}"
gear_material = "{soft}"

[tolerances]
element_tolerance = "ISO 3290 G10"
crank_tolerance = "{self.crank_tolerance}"
cage_tolerance = "IT{self.cage_grade}"
gear_tolerance = "IT{self.gear_grade}"
cage_offset = "3 sigma"
crank_deviation = "{self.crank_deviation}"

[operation]
max_twist = "{self.max_twist:g} arcmin"
"""


_GROUND = Drawing("drive_1")
_MILLED = Drawing("drive_2", cage_grade=6, gear_grade=9)
_PRINTED = Drawing("drive_3", plastic=True, cage_grade=13, gear_grade=11, max_twist=40.0)
N_VARIATIONS = 4


def _variation(number: int) -> Drawing:
    """A drive with other sizes, grades and numbers of elements."""
    rng = np.random.default_rng(np.random.SeedSequence(20, spawn_key=(number,)))
    base = (_GROUND, _MILLED, _PRINTED, _MILLED)[number]
    ratio = int(rng.choice([25, 29, 33]))
    return replace(
        base,
        preset="",
        ratio=ratio,
        lobes=ratio + int(rng.choice([-1, 1])),
        elements=3 * int(rng.integers(20, 30)),
        element_radius=round(7.0 * rng.uniform(0.9, 1.1), 2),
        crank_radius=round(41.0 * rng.uniform(0.95, 1.1), 1),
        # Fewer lobes allow a greater eccentricity before the profile intersects itself.
        eccentricity=round(0.7 * 29 / ratio * rng.uniform(0.9, 1.05), 3),
        cage_grade=base.cage_grade + int(rng.integers(-1, 2)),
        gear_grade=base.gear_grade + int(rng.integers(-1, 2)),
        crank_deviation=str(rng.choice(["element", "eccentric"])),
    )


DRAWINGS: tuple[Drawing, ...] = (
    _GROUND,
    _MILLED,
    _PRINTED,
    *(replace(d, lobes=28) for d in (_GROUND, _MILLED, _PRINTED)),
    *(_variation(k) for k in range(N_VARIATIONS)),
)


@functools.cache
def load(index: int) -> sm.Drive:
    """The drive of `DRAWINGS[index]`, read from its file as the diagnosis reads it."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", sm.DoesNotFitWarning)
        path = Path(folder, "drive.toml")
        path.write_text(DRAWINGS[index].toml, encoding="utf-8")
        return sm.load_drive(path)
