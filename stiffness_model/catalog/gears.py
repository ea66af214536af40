"""Published gears for comparison: their stiffness as the makers state it, each row with its source.

The rows are in `catalog.toml`; users' own rows come from a TOML file of the same form. A row without numbers states
where they would be found, and has no curve.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, expect, expect_number, refuse_unknown
from ..io.toml_files import parse_toml, read_packaged, read_text
from ..numerics.arrays import Array
from ..units import parse_quantity

_TEXTS = ("maker", "type", "kind", "size", "ratio", "source", "page", "note")
_QUANTITIES = {
    "t1": "torque",
    "t2": "torque",
    "rated_torque": "torque",
    "acceleration_torque": "torque",
    "momentary_torque": "torque",
    "k1": "torsional stiffness",
    "k2": "torsional stiffness",
    "k3": "torsional stiffness",
    "stiffness": "torsional stiffness",
    "lost_motion_below": "angle",
    "hysteresis_below": "angle",
    "transmission_accuracy_below": "angle",
}
FIELDS = (*_TEXTS, *_QUANTITIES, "second_hand")
"""Every key of a row."""
_SEGMENTS = ("t1", "t2", "k1", "k2", "k3")


@dataclass(frozen=True)
class CatalogGear:
    """One published gear. Torques in N.m, stiffness in N.m/rad, angles in rad; None where none is published.

    The stiffness is k1 up to the torque t1, k2 up to t2 and k3 beyond, or one `stiffness` throughout. *_below: upper
    limits as stated. second_hand: quoted by others from the maker's page. ratio is a text, since some rows hold for a
    range ("above 50").

    Raises `InputError` for a row without maker, type or source, a value that is not positive, t1 not below
    t2, limits without their stiffnesses, or both kinds of stiffness.
    """

    maker: str
    type: str
    source: str
    kind: str = ""
    size: str = ""
    ratio: str = ""
    page: str = ""
    note: str = ""
    t1: float | None = None
    t2: float | None = None
    k1: float | None = None
    k2: float | None = None
    k3: float | None = None
    stiffness: float | None = None
    lost_motion_below: float | None = None
    hysteresis_below: float | None = None
    transmission_accuracy_below: float | None = None
    rated_torque: float | None = None
    acceleration_torque: float | None = None
    momentary_torque: float | None = None
    second_hand: bool = False

    def __post_init__(self) -> None:
        at = f"gear {self.maker} {self.type}".rstrip()
        for name in _TEXTS:
            value = getattr(self, name)
            needed = name in ("maker", "type", "source")
            expect(
                isinstance(value, str) and (bool(value.strip()) or not needed),
                "a text that is not empty" if needed else "a text",
                value,
                f"{at}: {name}",
            )
        for name in _QUANTITIES:
            value = getattr(self, name)
            if value is not None:
                expect_number(value, "a positive value", f"{at}: {name}", low=0)
        expect(isinstance(self.second_hand, bool), "true or false", self.second_hand, f"{at}: second_hand")
        given = [name for name in _SEGMENTS if getattr(self, name) is not None]
        expect(
            self.stiffness is None or not given,
            "either one stiffness or t1, t2, k1, k2 and k3",
            f"stiffness and {', '.join(given)}",
            at,
        )
        if self.t1 is not None or self.t2 is not None:
            expect(len(given) == len(_SEGMENTS), "t1, t2, k1, k2 and k3 together", ", ".join(given), at)
            assert self.t1 is not None
            assert self.t2 is not None
            expect(self.t1 < self.t2, "t1 below t2", f"{self.t1:g} and {self.t2:g} N.m", at)

    @property
    def name(self) -> str:
        """The name under which commands take the gear: its type, and its ratio where the row states one.

        >>> [gear.name for gear in catalog()][:2]
        ['CHA-40A-50', 'CHA-40A']
        """
        return f"{self.type}-{self.ratio}" if _is_number(self.ratio) else self.type

    @property
    def label(self) -> str:
        """Maker, type and ratio in one text.

        >>> catalog()[0].label
        'Harmonic Drive CHA-40A (ratio 50)'
        """
        return f"{self.maker} {self.type}" + (f" (ratio {self.ratio})" if self.ratio else "")

    @property
    def has_curve(self) -> bool:
        """Whether the published numbers give the twist over torque."""
        return self.stiffness is not None or self.t1 is not None

    @property
    def greatest_torque(self) -> float | None:
        """The greatest allowed torque of the row, N.m; None if it states none."""
        named = (self.rated_torque, self.acceleration_torque, self.momentary_torque)
        return max((torque for torque in named if torque is not None), default=None)

    def twist_at(self, torque: ArrayLike) -> Array:
        """Twist at the output, rad, under torques in N.m, of any shape, with the input locked; k3 holds beyond t2.

        It is an odd function without lost motion and hysteresis. Raises `InputError` for a row that publishes no curve.

        >>> from stiffness_model.units import ARCMIN
        >>> (catalog()[0].twist_at([54, 196]) / ARCMIN).round(3).tolist()
        [1.856, 5.343]
        """
        values = np.asarray(torque, float)
        size = np.abs(values)
        if self.stiffness is not None:
            return values / self.stiffness
        if self.t1 is None or self.t2 is None or self.k1 is None or self.k2 is None or self.k3 is None:
            raise InputError(
                f"gear {self.label}: expected a published stiffness curve, got none (source: {self.source})"
            )
        first = np.minimum(size, self.t1) / self.k1
        second = np.clip(size - self.t1, 0.0, self.t2 - self.t1) / self.k2
        third = np.maximum(size - self.t2, 0.0) / self.k3
        return np.sign(values) * (first + second + third)


def catalog(own: str | os.PathLike[str] | None = None) -> tuple[CatalogGear, ...]:
    """The published gears that come with the package, then those of the TOML file `own`, if given.

    Raises `InputError` for a file that cannot be read or a row that fails the checks.

    >>> sum(gear.has_curve for gear in catalog()), len(catalog())
    (3, 8)
    """
    rows = read_rows(read_packaged("catalog", "catalog"), "catalog.toml")
    return rows if own is None else rows + read_rows(read_text(Path(own), "TOML catalogue"), str(Path(own)))


def read_rows(text: str, where: str) -> tuple[CatalogGear, ...]:
    """Rows of a catalogue in TOML: tables [[gear]] with the keys `FIELDS`, quantities as texts with units.

    >>> text = '[[gear]]\\nmaker="A"\\ntype="B"\\nsource="own"\\nstiffness="20 N.m/arcmin"'
    >>> round(read_rows(text, "own.toml")[0].stiffness)
    68755
    """
    table = parse_toml(text, where, "a TOML catalogue")
    refuse_unknown("table", table, ("gear",), where)
    rows = table.get("gear", [])
    expect(
        isinstance(rows, list) and len(rows) > 0 and all(isinstance(row, Mapping) for row in rows),
        "one table [[gear]] or more",
        rows or "none",
        where,
    )
    return tuple(_row(row, f"{where}: gear {number}") for number, row in enumerate(rows, 1))


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _row(row: Mapping[str, Any], where: str) -> CatalogGear:
    refuse_unknown("field", row, FIELDS, where)
    missing = [name for name in ("maker", "type", "source") if name not in row]
    expect(not missing, f"the field {missing[0]!r}" if missing else "", "none", where)
    values = dict(row)
    for name in set(_QUANTITIES) & set(row):
        # A bare number would be taken as SI; a file states its units.
        text = row[name] if isinstance(row[name], str) else repr(row[name])
        values[name] = parse_quantity(text, _QUANTITIES[name], f"{where}: {name}")
    if isinstance(values.get("ratio"), int) and not isinstance(values["ratio"], bool):
        values["ratio"] = str(values["ratio"])
    try:
        return CatalogGear(**values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
