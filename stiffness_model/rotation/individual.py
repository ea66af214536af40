"""One drive with its own parts, and where its elements stand while crank and cage turn.

The gear stands still. With the cage at the output angle theta the untwisted crank stands at i theta, i the signed
ratio. An element k of the cage then has its eccentric at

    beta_k = start + (i - 1) theta + 2 pi k/n        (eq. 20, in motion)

past itself. Balls, bores and the crank's races under them stay with k. The lobes stay in the gear: of the elements
j = 0, 1, ... of one eccentric, the next faces the next lobe (|i| elements to |i| +- 1 lobes), and with every turn of
beta an element comes to its next one. So all that the contacts see depends on the twist and on theta alone,
and repeats when theta has gone round once, |i| turns of the crank, and not before: then every element has met
every lobe of its eccentric. Equal lobes repeat z times, equal elements n/eccentrics times in that turn, and
without any deviation only the passing of the elements remains, z n times.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..drawing.drive import PARTS, Drive
from ..drawing.sampling import Deviations, check_seed
from ..errors import expect, expect_number
from ..geometry.ball_path import wrap
from ..io.drawing_toml import DriveLike, as_drive
from ..lookup.element_table import FADE_HALF_WIDTH
from ..numerics.arrays import Array

Index = NDArray[np.intp]

_STREAM = (0, 0)
"""Apart from the populations' streams, whose keys have one number."""


@dataclass(frozen=True)
class Individual:
    """One drive of a drawing.

    start: position beta of element 0 on the profile at output angle 0, rad. element, crank, cage: (n,) m, radii of
    every ball, of the crank's race under it and of its bore. lobe: (eccentrics, lobes) m, distance q of the
    equidistant at every lobe of the gear. Elements k, k + eccentrics, ... share an eccentric. seed: of the draw, None
    for one that was not drawn.

    Raises `InputError` for arrays of another shape or sizes that are not positive.
    """

    drive: Drive
    start: float
    element: Array
    crank: Array
    cage: Array
    lobe: Array
    seed: int | None = None

    def __post_init__(self) -> None:
        n, shape = (self.drive.elements,), (self.drive.eccentrics, self.drive.lobes)
        expect_number(self.start, "a finite angle in rad", "start")
        for name, size in (("element", n), ("crank", n), ("cage", n), ("lobe", shape)):
            values = getattr(self, name)
            sound = np.shape(values) == size and bool((np.isfinite(values) & (np.asarray(values) > 0)).all())
            expect(sound, f"positive lengths in m of shape {size}", np.shape(values), name)
        expect(
            self.drive.elements_per_row <= self.drive.transmission_ratio,
            f"at most {self.drive.transmission_ratio:g} elements on an eccentric, as many as the cage has places",
            self.drive.elements_per_row,
            f"{self.drive.name}: elements",
        )


def draw_individual(drive: DriveLike, seed: int) -> Individual:
    """The drive that `seed` stands for, by the drawing's tolerances; the same seed gives the same drive.

    >>> from stiffness_model import load_drive
    >>> one = draw_individual(load_drive("drive_1"), 7)
    >>> one.element.shape, one.lobe.shape
    ((87,), (3, 30))
    """
    drive = as_drive(drive)
    check_seed(seed)
    expect(
        drive.beyond.is_plain,
        "a drawing of the plain contact model (an individual's parts are solved one by one)",
        "switches beyond it",
        drive.name,
    )
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(seed), spawn_key=_STREAM)))
    start = float(rng.uniform(-math.pi, math.pi))
    normal = {part: rng.standard_normal(drive.elements) for part in ("element", "crank", "cage")}
    if drive.crank_deviation == "eccentric":
        normal["crank"] = normal["crank"][np.arange(drive.elements) % drive.eccentrics]
    normal["gear"] = rng.standard_normal((drive.eccentrics, drive.lobes))
    return _from_deviates(drive, start, normal, int(seed))


def mean_individual(drive: DriveLike, start: float = 0.0) -> Individual:
    """A drive whose every part sits in the middle of its tolerance: no deviations but the drawing's mean offsets."""
    drive = as_drive(drive)
    n = np.zeros(drive.elements)
    return _from_deviates(
        drive, start, {"element": n, "crank": n, "cage": n, "gear": np.zeros((drive.eccentrics, drive.lobes))}, None
    )


def _from_deviates(drive: Drive, start: float, normal: Mapping[str, Array], seed: int | None) -> Individual:
    """The individual of standard normal deviates by part."""
    nominal = dict.fromkeys(PARTS, drive.element_radius) | {"crank": drive.crank_radius}
    radius = {
        part: nominal[part] + drive.tolerances[part].offset + drive.tolerances[part].sigma * normal[part]
        for part in PARTS
    }
    return Individual(drive, start, radius["element"], radius["crank"], radius["cage"], radius["gear"], seed)


def angles_over_turn(drive: Drive, per_pass: int = 8) -> Array:
    """Output angles, rad, spread evenly over one turn of the output, `per_pass` between one element's passing and
    the next (of all z n in the turn). Angles a whole number of passes apart see the elements at the same places.

    >>> from stiffness_model import load_drive
    >>> len(angles_over_turn(load_drive("drive_1"), per_pass=4)) == 4 * 30 * 87
    True
    """
    expect(isinstance(per_pass, int) and per_pass >= 1, "a whole number of at least 1", per_pass, "per_pass")
    count = per_pass * drive.lobes * drive.elements
    return 2 * np.pi * np.arange(count) / count


@dataclass(frozen=True)
class ElementPositions:
    """The elements that may carry at m output angles, side by side along the profile; arrays (m, width).

    element: its number; row, lobe: where in `Individual.lobe` its lobe stands; beta: rad; weight: 1, falling to 0 over
    `FADE_HALF_WIDTH` to either side of the place where the profile is cut away, so that the torque has a derivative.
    """

    element: Index
    row: Index
    lobe: Index
    beta: Array
    weight: Array


@dataclass(frozen=True)
class Window:
    """The part of the profile on which elements carry: |beta| up to `limit`, rad, with its fading edge up to `reach`;
    at most `width` elements stand there at once."""

    limit: float
    reach: float
    width: int

    @staticmethod
    def of_drive(drive: Drive) -> Window:
        """The window of a drawing."""
        limit = drive.usable_limit
        if limit >= math.pi:
            return Window(limit, math.pi, drive.elements)
        reach = min(limit + FADE_HALF_WIDTH, math.pi)
        return Window(limit, reach, min(math.floor(reach / math.pi * drive.elements) + 1, drive.elements))

    def weight(self, beta: Array) -> Array:
        """`ElementPositions.weight`."""
        if self.reach >= math.pi:
            return np.ones_like(beta)
        return np.clip((self.limit - np.abs(beta)) / (2 * FADE_HALF_WIDTH) + 0.5, 0.0, 1.0)


def element_lobe_pairs(drive: Drive) -> tuple[Index, Index]:
    """Row and lobe of the meetings of elements with lobes, (n z,) each, in the order in which they come to one beta.

    Element j + 1 of a row stands one bore back in the cage and faces the lobe i/(elements of a row) further back; after
    a round of the cage comes its next lobe. Where fewer elements than places are drawn, evenly, each has the lobe of
    the place nearest to it.
    """
    rows, per_row = drive.eccentrics, drive.elements_per_row
    place = np.arange(drive.elements * drive.lobes)
    j = place // rows
    lobe = -np.round(j % per_row * drive.ratio / per_row).astype(np.intp) - (j // per_row) * round(drive.ratio)
    return place % rows, lobe % drive.lobes


def low_discrepancy_angles(count: int) -> Array:
    """Output angles, (count,) rad, that lie evenly over a turn and keep step with nothing that turns: by the golden
    ratio."""
    return 2 * np.pi * (np.arange(count, dtype=float) * 0.6180339887498949 % 1)


def element_positions(individual: Individual, window: Window, output_angle: Array) -> ElementPositions:
    """Where the elements stand at output angles, (m,) rad, within the drawing's window."""
    drive = individual.drive
    step = 2 * np.pi / drive.elements
    # In passes of elements: a whole number of them moves every element to the place of the one before.
    passed = (individual.start + (drive.ratio - 1) * output_angle) / step
    first = np.ceil(-window.reach / step - passed)
    place = first[:, None] + np.arange(window.width)
    beta = (passed[:, None] + place) * step
    row, lobe = element_lobe_pairs(drive)
    count = place.astype(np.intp)
    meeting = count % len(row)
    return ElementPositions(count % drive.elements, row[meeting], lobe[meeting], beta, window.weight(beta))


def elements_at(individual: Individual, output_angle: float) -> tuple[Deviations, Array]:
    """All elements of an individual at an output angle, rad, with the lobes they face, and `ElementPositions.weight`.

    Arrays (1, n), element after element.

    >>> from stiffness_model import load_drive
    >>> one = draw_individual(load_drive("drive_1"), 7)
    >>> at, weight = elements_at(one, 0.0)
    >>> bool(at.beta[0, 0] == one.start), bool((at.element[0] == one.element).all())
    (True, True)
    """
    n = individual.drive.elements
    at = element_positions(individual, Window(math.pi, math.pi, n), np.array([float(output_angle)]))
    order = np.argsort(at.element[0])
    q = individual.lobe[at.row[0], at.lobe[0]][order]
    beta = wrap(at.beta[0, order])
    parts = (values[None] for values in (beta, individual.element, individual.crank, individual.cage, q))
    return Deviations(*parts), Window.of_drive(individual.drive).weight(beta)[None]
