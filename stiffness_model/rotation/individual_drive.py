"""One drive with its own parts, and the kinematics by which they meet as crank and cage turn.

The gear is fixed. With the cage at the output angle theta, the untwisted crank is at i theta, i being the signed ratio.
The eccentric is then past element k of the cage by the angle

    beta_k = start + (i - 1) theta + 2 pi k/n        (eq. 20, in motion)

Balls, bores and the crank's raceways under them stay with k. The lobes stay in the gear: of the elements j = 0, 1, ...
of one eccentric, each faces the lobe after that of its predecessor (|i| elements to |i| +- 1 lobes), and with every
turn of beta an element reaches its next lobe. The contacts therefore depend on the twist and on theta only, with a
period of one turn of the output, |i| turns of the crank, and no shorter one: within it every element meets every lobe
of its eccentric. In that turn, equal lobes repeat the pattern z times, equal elements n/eccentrics times, and without
any deviations it repeats z n times, with every element that passes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display import dataframe, html_table
from ..drawing.drive import PARTS, Drive
from ..drawing.sampling import check_seed
from ..errors import expect, expect_number
from ..io.drawing_toml import DriveLike, as_drive
from ..numerics.arrays import Array
from ..units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes


N_PLOT_ANGLES, N_PLOT_TWISTS = 240, 61
"""Points of `Individual.plot` along the crank's turn and the twist; chosen by judgement, some 0.2 s of computation."""
_STREAM = (0, 0)
"""Key of the random stream; differs from those of the populations, which have one number."""


@dataclass(frozen=True)
class Individual:
    """One drive of a drawing.

    start: position beta of element 0 on the profile at output angle 0, rad. element, crank, cage: (n,) m, radii of
    every ball, of the crank's raceway under it and of its bore. lobe: (eccentrics, lobes) m, distance q of the
    equidistant at every lobe of the gear. Elements k, k + eccentrics, ... share an eccentric. seed: of the draw; None
    for an individual that was not drawn.

    Raises `InputError` for arrays of another shape or radii that are not positive.
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
            f"at most {self.drive.transmission_ratio:g} elements on an eccentric, as many as the ratio gives seats",
            self.drive.elements_per_row,
            f"{self.drive.name}: elements",
        )

    def __repr__(self) -> str:
        return f"Individual({self.drive.name!r}, {'no deviations drawn' if self.seed is None else f'seed {self.seed}'})"

    def _repr_html_(self) -> str:
        parts = {"balls" if self.drive.element == "ball" else "rollers": "element", "bores": "cage", "lobes": "lobe"}
        rows = {
            "seed": "not drawn" if self.seed is None else self.seed,
            **{f"{text}, spread [um]": f"{np.std(getattr(self, n)) / MICROMETRE:.3g}" for text, n in parts.items()},
        }
        return html_table(f"individual of {self.drive.name}", rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Torque ripple over one turn of the crank and the twist, on `ax` or on new axes, which are returned."""
        from .maps import turning_map
        from .ripple_plots import ripple_map

        drive = self.drive
        angle = np.linspace(0, 2 * np.pi / drive.transmission_ratio, N_PLOT_ANGLES, endpoint=False)
        return ripple_map(turning_map(self, np.linspace(-1, 1, N_PLOT_TWISTS) * drive.max_twist, angle), ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each part: ball, crank race, bore, lobe. Raises `InputError` without
        pandas.
        """
        drive, rows = self.drive, self.drive.eccentrics
        own = np.arange(drive.elements)
        numbers = [own, own, own, np.tile(np.arange(drive.lobes), rows)]
        eccentric = [own % rows, own % rows, own % rows, np.repeat(np.arange(rows), drive.lobes)]
        radius = np.concatenate([self.element, self.crank, self.cage, self.lobe.ravel()])
        nominal = [drive.element_radius, drive.crank_radius, drive.element_radius, drive.element_radius]
        sizes = [len(number) for number in numbers]
        return dataframe(
            {
                "part": np.repeat(["element", "crank", "cage", "gear"], sizes),
                "number": np.concatenate(numbers),
                "eccentric": np.concatenate(eccentric),
                "radius [mm]": 1e3 * radius,
                "deviation [um]": (radius - np.repeat(nominal, sizes)) / MICROMETRE,
            }
        )


def draw_individual(drive: DriveLike, seed: int) -> Individual:
    """The individual of a seed, drawn from the drawing's tolerances; the same seed gives the same drive.

    >>> from stiffness_model import load_drive
    >>> one = draw_individual(load_drive("drive_1"), 7)
    >>> one.element.shape, one.lobe.shape
    ((87,), (3, 30))
    """
    drive = as_drive(drive)
    check_seed(seed)
    expect(
        drive.beyond.is_plain,
        "a drawing of the plain contact model (an individual's elements are solved one by one)",
        "further model options",
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
    """A drive with every part in the middle of its tolerance zone: no deviations but the drawing's mean offsets."""
    drive = as_drive(drive)
    n = np.zeros(drive.elements)
    return _from_deviates(
        drive, start, {"element": n, "crank": n, "cage": n, "gear": np.zeros((drive.eccentrics, drive.lobes))}, None
    )


def _from_deviates(drive: Drive, start: float, normal: Mapping[str, Array], seed: int | None) -> Individual:
    """The individual of standard normal deviates, by part."""
    nominal = dict.fromkeys(PARTS, drive.element_radius) | {"crank": drive.crank_radius}
    radius = {
        part: nominal[part] + drive.tolerances[part].offset + drive.tolerances[part].sigma * normal[part]
        for part in PARTS
    }
    return Individual(drive, start, radius["element"], radius["crank"], radius["cage"], radius["gear"], seed)


def angles_over_turn(drive: Drive, per_pass: int = 8) -> Array:
    """Output angles, (n,) rad, spread evenly over one turn of the output of `drive`.

    per_pass: angles between one element's passing and the next (z n passings in the turn). Angles that differ by a
    whole number of passings have elements at the same positions.

    >>> from stiffness_model import load_drive
    >>> len(angles_over_turn(load_drive("drive_1"), per_pass=4)) == 4 * 30 * 87
    True
    """
    expect(isinstance(per_pass, int) and per_pass >= 1, "a whole number of at least 1", per_pass, "per_pass")
    count = per_pass * drive.lobes * drive.elements
    return 2 * np.pi * np.arange(count) / count
