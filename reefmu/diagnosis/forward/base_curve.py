"""The base curve that a record is compared with: a drawing, a curve file, or a power law.

All three give a torque over twist and clearance (`elastic.ElasticTorque`), shape parameters that are fitted with every
set of effects, and a `Lookup`, so that `reefmu.simulate` runs the corrected model like any other. Without a drawing the
lever between a clearance and the twist that it frees is unknown: a clearance, m, is then the play to either side, rad,
times `NOMINAL_LEVER`.
"""

from __future__ import annotations

import csv
import os
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stiffness_model.cycloidal.cycloidal_drive import CycloidalDrive
from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError, expect
from stiffness_model.kinds import AnyDrive
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.curve_lookup import NOMINAL_LEVER, CurveLookup, curve_lookup
from stiffness_model.lookup.element_table import ElementTable
from stiffness_model.lookup.modulus import ModulusShares
from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS
from ...model.contacts.element import with_contact_tables
from ...record import check_range, convert_units
from ..preprocessing.trace import Trace
from .elastic import CurveTorque, ElasticTorque, LookupTorque, PowerLawTorque, ScaledTorque

SCALE_DEVIATION = 0.05
"""Relative standard deviation of a curve file's scale where the file states no band. Chosen by judgement."""
MIN_SCALE_DEVIATION = 0.002
"""Least of it where the file states a band. Chosen by judgement."""
SCALE_RANGE, WIDE_SCALE_RANGE = (-0.5, 1.0), (-0.9, 4.0)
"""Bounds of the change of a curve's scale; the wide ones for drawings with wide tolerances. Chosen by judgement."""
BAND_DEVIATIONS = 2.5631
"""Width of the band from the 10th to the 90th percentile of a normal distribution, in standard deviations."""

EXPONENT = (1.2, 0.3, 6.0)
"""Start and bounds of the exponent of a power law. Chosen by judgement, between a spring (1) and a ball (1.5); the
bounds leave room for a curve that play or saturation bends."""
LOG_SCALE_RANGE = 5.0
"""Distance of the bounds of a power law's scale from its start, as a logarithm. Chosen by judgement."""
CONTACT_RANGE = 1e-3
"""Twist over which the contact of a power law sets in smoothly, over its greatest twist. Chosen by judgement, below the
resolution of a record."""
PLAY = "play [rad]"
"""Name of the shape parameter that is the play to either side."""
TABLE_RANGE, TABLE_NODES = 1.6, 321
"""Twist over the greatest twist of a base curve to which it is tabulated, and nodes of that table. Chosen by judgement:
the spacing is a hundredth of the greatest twist."""


@dataclass(frozen=True)
class ShapeParameters:
    """Parameters of a base curve that are fitted with every set of effects, (k,) each.

    prior_deviation: standard deviations of Gaussian priors about `start`, infinite where nothing is known.
    exponent_bound: "low" or "high" for an exponent that is held at a bound of the fit in which it was determined.
    """

    names: tuple[str, ...]
    start: Array
    low: Array
    high: Array
    prior_deviation: Array
    exponent_bound: str = ""

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.names)


NO_SHAPE = ShapeParameters((), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))
"""No shape parameters: of a drawing's curve."""


@dataclass(frozen=True)
class BaseCurve:
    """kind: "drawing", "curve" or "power law"; ratio: signed, None where a record without a drawing has a locked
    shaft; lever: m/rad, clearance over the twist that it frees; full_torque: N.m; max_twist: rad; lookup: tables of the
    curve, None for a power law; element, modulus: of a drawing; source: name; cycloidal: that drive, for its scatter.
    """

    kind: str
    elastic: ElasticTorque
    ratio: float | None
    lever: float
    full_torque: float
    max_twist: float
    shape: ShapeParameters
    drive: Drive | None = None
    lookup: Lookup | None = None
    element: ElementTable | None = None
    modulus: ModulusShares | None = None
    source: str = ""
    cycloidal: CycloidalDrive | None = None


def drawing_base(drive: Drive, lookup: Lookup) -> BaseCurve:
    """The mean torque of a drawing's lookup; individual drives differ by scatter, not by shape parameters."""
    whole = with_contact_tables(lookup, drive, tuple(EFFECTS.values()))
    return BaseCurve(
        kind="drawing",
        elastic=LookupTorque.of(lookup),
        ratio=drive.ratio,
        lever=drive.eccentricity * abs(drive.ratio),
        full_torque=lookup.full_torque,
        max_twist=drive.max_twist,
        shape=NO_SHAPE,
        drive=drive,
        lookup=whole,
        element=whole.element,
        modulus=whole.modulus,
        source=drive.name,
    )


def curve_base(path: str | os.PathLike[str], ratio: float | None) -> BaseCurve:
    """The curve of a CSV file with the columns `twist [unit]` and `torque_mean [N.m]`, as `reefmu curve` writes it, or
    `torque` or `output_torque`.

    ratio: of the record, see `preprocessing.audit.ratio_from_angles`. Raises `InputError` for a file without these
    columns or with twists that do not increase.
    """
    twist, torque, spread = _read_curve(Path(path))
    return _scaled_curve(curve_lookup(twist, torque, NOMINAL_LEVER, Path(path).stem, ratio), ratio, spread, str(path))


def lookup_base(drive: AnyDrive, lookup: CurveLookup) -> BaseCurve:
    """The curve of a data sheet, whose scale is as uncertain as that of a curve file without a band.

    The hysteresis loss of the sheet, which is an upper limit for most gears, is not in it: the record decides.
    """
    return _scaled_curve(lookup, drive.ratio, SCALE_DEVIATION, drive.name)


def table_base(drive: AnyDrive, lookup: Lookup) -> BaseCurve:
    """The mean curve of a drive's tables, its scale as uncertain as their band; for drives of interacting contacts."""
    twist, lever = lookup.twist.nodes, 2 * lookup.clearance.stop / drive.max_twist
    low, high = (float(lookup.torque(drive.max_twist, band=band)) for band in (-1, 1))
    deviation = max(MIN_SCALE_DEVIATION, (high - low) / lookup.full_torque / BAND_DEVIATIONS)
    curve = curve_lookup(twist, lookup.torque(twist), lever, drive.name, drive.ratio)
    cycloidal = drive if isinstance(drive, CycloidalDrive) else None
    return replace(_scaled_curve(curve, drive.ratio, deviation, drive.name, WIDE_SCALE_RANGE), cycloidal=cycloidal)


def _scaled_curve(
    lookup: CurveLookup, ratio: float | None, deviation: float, source: str, bounds: tuple[float, float] = SCALE_RANGE
) -> BaseCurve:
    """A base curve whose scale, relative to the curve's, is uncertain by a standard deviation within bounds."""
    edges = np.array(bounds)[:, None]
    return BaseCurve(
        kind="curve",
        elastic=ScaledTorque(CurveTorque(lookup)),
        ratio=ratio,
        lever=lookup.lever,
        full_torque=lookup.full_torque,
        max_twist=lookup.twist.stop,
        shape=ShapeParameters(("scale",), np.zeros(1), edges[0], edges[1], np.array([deviation])),
        lookup=lookup,
        source=source,
    )


def power_base(trace: Trace) -> BaseCurve:
    """A power law for the record of a gear without a drawing or a curve."""
    max_twist = float(np.ptp(np.quantile(trace.twist, [0.002, 0.998])) / 2) or 1e-3
    full = float(np.quantile(np.abs(trace.torque - np.median(trace.torque)), 0.998)) or 1.0
    start, low, high = EXPONENT
    return BaseCurve(
        kind="power law",
        elastic=PowerLawTorque(max_twist, NOMINAL_LEVER, CONTACT_RANGE * max_twist),
        ratio=trace.ratio,
        lever=NOMINAL_LEVER,
        full_torque=full,
        max_twist=max_twist,
        shape=ShapeParameters(
            ("log_scale", "exponent"),
            np.array([np.log(full), start]),
            np.array([np.log(full) - LOG_SCALE_RANGE, low]),
            np.array([np.log(full) + LOG_SCALE_RANGE, high]),
            np.array([np.inf, np.inf]),
        ),
        source="power law",
    )


def tabulate_base(base: BaseCurve, shape: Array) -> Lookup:
    """Tables of a base curve with the shape parameters (k,) of a fit."""
    if base.kind == "drawing":
        assert base.lookup is not None
        return base.lookup
    if isinstance(base.lookup, CurveLookup):
        # The same points, so that the corners stay where they are.
        line, factor = base.lookup.line, 1 + float(shape[0])
        return curve_lookup(line.twist, factor * line.torque, base.lever, base.lookup.curve["name"], base.ratio)
    twist = np.linspace(-TABLE_RANGE, TABLE_RANGE, TABLE_NODES) * base.max_twist
    torque = base.elastic.evaluate(twist, np.zeros_like(twist), shape)[0]
    return curve_lookup(twist, torque, base.lever, Path(base.source).stem, base.ratio)


def _read_curve(path: Path) -> tuple[Array, Array, float]:
    """Twist (n,), rad, torque (n,), N.m, and the relative standard deviation of its scale."""
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
    expect(bool((np.diff(twist) > 0).all()), "twists that increase", "twists that do not", where)
    spread = SCALE_DEVIATION
    if "torque_p10" in titles and "torque_p90" in titles:
        high = torque > 0.5 * torque.max()
        share = (column("torque_p90") - column("torque_p10"))[high] / torque[high]
        spread = max(MIN_SCALE_DEVIATION, float(share.mean()) / BAND_DEVIATIONS)
    return twist, torque, spread
