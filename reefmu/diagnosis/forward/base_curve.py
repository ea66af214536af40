"""The base curve that a record is held against: a drawing, a curve file, or a free power law.

All three give a torque over twist and clearance (`elastic.ElasticTorque`), base parameters that are fitted together
with every candidate, and a `Lookup`, so that the corrected model runs in `reefmu.simulate` like any other.
Without a drawing there is no lever that turns a clearance into a twist: there the clearance, m, is the play,
rad, to either side times `NOMINAL_LEVER`.
"""

from __future__ import annotations

import csv
import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError, expect
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.element_table import ElementTable
from stiffness_model.lookup.modulus import ModulusShares
from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS
from ...model.contacts.curve_table import curve_lookup
from ...model.contacts.element import with_contact_tables
from ...record import Record, check_range, convert_units
from ..preprocessing.audit import ANGLE_RESOLUTION, exceeds_resolution
from ..preprocessing.trace import Trace
from .elastic import ElasticTorque, LookupTorque, PowerLawTorque
from .vectorised import Number

NOMINAL_LEVER = 0.01
"""m/rad, where no drawing gives eccentricity and ratio."""
SCALE_DEVIATION = 0.05
"""Standard deviation of a curve file's scale, as a share, where the file states no band."""


@dataclass(frozen=True)
class ShapeParameters:
    """Parameters of a base curve that are fitted with every set of effects, (k,) each.

    prior_deviation: standard deviations of Gaussian priors about `start`, infinite where nothing is known.
    """

    names: tuple[str, ...]
    start: Array
    low: Array
    high: Array
    prior_deviation: Array

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.names)


NO_SHAPE = ShapeParameters((), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))
"""Of a base curve that nothing can change."""


@dataclass(frozen=True)
class BaseCurve:
    """kind: "drawing", "curve" or "power law"; ratio: signed, 1 for a still crank; lever: m/rad, clearance over
    the twist that it frees; shape: its own parameters;
    full_torque: N.m; lookup: tables of the curve, None for a power law until its parameters are known.
    """

    kind: str
    elastic: ElasticTorque
    ratio: float
    lever: float
    full_torque: float
    max_twist: float
    shape: ShapeParameters
    drive: Drive | None = None
    lookup: Lookup | None = None
    element: ElementTable | None = None
    modulus: ModulusShares | None = None
    source: str = ""


@dataclass(frozen=True)
class ScaledTorque:
    """Another elastic torque times a factor 1 + shape[0]: a curve file's uncertain scale."""

    inner: ElasticTorque

    def evaluate(self, twist: Array, clearance: Number, shape: Array) -> tuple[Array, Array, Array, list[Array]]:
        """See `ElasticTorque`; shape is (share,)."""
        value, by_twist, by_clearance, _ = self.inner.evaluate(twist, clearance, np.zeros(0))
        factor = 1 + float(shape[0])
        return factor * value, factor * by_twist, factor * by_clearance, [value]


def drawing_base(drive: Drive, lookup: Lookup) -> BaseCurve:
    """The mean torque of a drawing's lookup. What individuals differ is the scatter's business, not a scale's."""
    whole = with_contact_tables(lookup, drive, tuple(EFFECTS.values()))
    return BaseCurve(
        "drawing",
        LookupTorque.of(lookup),
        drive.ratio,
        drive.eccentricity * abs(drive.ratio),
        lookup.full_torque,
        drive.max_twist,
        NO_SHAPE,
        drive,
        whole,
        whole.element,
        whole.modulus,
        drive.name,
    )


def ratio_from_angles(record: Record) -> float:
    """The signed transmission ratio that a record's own angles show; 1 where the crank stands still.

    The crank's angle over the output's is a straight line but for the twist; its slope is the ratio, taken as the
    next whole number where that is within 2 %. Raises `InputError` where the angles show no ratio.
    """
    crank, output = record.crank_angle, record.output_angle
    if np.ptp(crank) == 0 or "crank_angle" in record.missing:
        return 1.0
    where = record.source or "record"
    if not exceeds_resolution(output, ANGLE_RESOLUTION, float(np.abs(output).max())):
        raise InputError(
            f"{where}: expected an output that turns, or a twist [rad] in place of the angles, for a gear "
            "without a drawing, got a turning crank at an output that stands still: no ratio can be known"
        )
    across, along = output - output.mean(), crank - crank.mean()
    slope = float(across @ along) / float(across @ across)
    residual = float(np.std(along - slope * across) / np.std(crank))
    if abs(slope) < 1.5 or residual > 0.05:
        raise InputError(
            f"{where}: expected a crank that turns with the output, or stands still, "
            "for a gear without a drawing, got angles that show no transmission ratio"
        )
    whole = round(slope)
    return float(whole if abs(slope - whole) < 0.02 * abs(slope) else slope)


def curve_base(path: str | os.PathLike[str], ratio: float = 1.0) -> BaseCurve:
    """A curve file: the columns of `reefmu curve`, or any `twist [unit]` and `torque [N.m]` (or torque_mean).

    ratio: of the record that is held against it, see `ratio_from_angles`.

    Raises `InputError` for a file without them or with twists that do not rise.
    """
    twist, torque, spread = _read_curve(Path(path))
    lookup = curve_lookup(twist, torque, NOMINAL_LEVER, Path(path).stem, ratio)
    one = np.ones(1)
    return BaseCurve(
        "curve",
        ScaledTorque(LookupTorque.of(lookup)),
        ratio,
        NOMINAL_LEVER,
        float(np.abs(torque).max()),
        float(np.abs(twist).max()),
        ShapeParameters(("scale",), 0 * one, -0.5 * one, one, spread * one),
        None,
        lookup,
        source=str(path),
    )


def power_base(trace: Trace) -> BaseCurve:
    """A free power law for a record of a gear that has no drawing and no curve."""
    max_twist = float(np.ptp(np.quantile(trace.twist, [0.002, 0.998])) / 2) or 1e-3
    full = float(np.quantile(np.abs(trace.torque - np.median(trace.torque)), 0.998)) or 1.0
    elastic = PowerLawTorque(max_twist, NOMINAL_LEVER, 1e-3 * max_twist)
    return BaseCurve(
        "power law",
        elastic,
        trace.ratio,
        NOMINAL_LEVER,
        full,
        max_twist,
        ShapeParameters(
            ("log_scale", "exponent"),
            np.array([np.log(full), 1.2]),
            np.array([np.log(full) - 5, 0.3]),
            np.array([np.log(full) + 5, 6.0]),
            np.array([np.inf, np.inf]),
        ),
        source="power law",
    )


def lookup_of(base: BaseCurve, shape: Array) -> Lookup:
    """Tables of the base curve with its fitted parameters."""
    if base.kind == "drawing":
        assert base.lookup is not None
        return base.lookup
    twist = np.linspace(-1.6, 1.6, 321) * base.max_twist
    torque = base.elastic.evaluate(twist, np.zeros_like(twist), shape)[0]
    return curve_lookup(twist, torque, base.lever, Path(base.source).stem, base.ratio)


def _read_curve(path: Path) -> tuple[Array, Array, float]:
    where = str(path)
    try:
        rows = [row for row in csv.reader(path.read_text("utf-8-sig").splitlines()) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{where}: expected a readable CSV file, got {error}") from None
    expect(len(rows) >= 4, "a header and at least three rows of numbers", f"{len(rows)} rows", where)
    titles = {}
    for index, title in enumerate(rows[0]):
        match = re.fullmatch(r"\s*(\w+)\s*(?:\[(.*)\])?\s*", title)
        if match:
            titles[match[1]] = index, (match[2] or "").strip()
    torque_name = next((name for name in ("torque_mean", "torque", "output_torque") if name in titles), None)
    expect(
        "twist" in titles and torque_name is not None,
        "columns 'twist [arcmin]' and 'torque_mean [N.m]'",
        rows[0],
        where,
    )
    assert torque_name is not None

    def column(name: str) -> Array:
        index, unit = titles[name]
        try:
            values = np.array([row[index] for row in rows[1:]], float)
        except (ValueError, IndexError) as error:
            raise InputError(f"{where}: expected numbers in column {name!r}, got {error}") from None
        quantity = "twist" if name == "twist" else "output_torque"
        values = convert_units(values, unit, quantity, where)
        expect(bool(np.isfinite(values).all()), f"finite numbers in column {name!r}", "nan or inf", where)
        check_range(quantity, values, where)
        return values

    twist, torque = column("twist"), column(torque_name)
    expect(bool((np.diff(twist) > 0).all()), "twists that rise", "twists that do not", where)
    spread = SCALE_DEVIATION
    if "torque_p10" in titles and "torque_p90" in titles:
        high = torque > 0.5 * torque.max()
        share = (column("torque_p90") - column("torque_p10"))[high] / torque[high]
        # 80 % of a normal distribution lie within +-1.2816 of its standard deviations.
        spread = max(0.002, float(share.mean()) / 2.5631)
    return twist, torque, spread
