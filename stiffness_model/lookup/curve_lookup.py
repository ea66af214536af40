"""The lookup of a twist-torque curve: lines between its points, without tables, drives or contacts.

A data sheet, a curve file and the curve that a diagnosis fits have no drawing. Their relation between clearance and
twist is unknown: a clearance, m, is here the twist, rad, that it frees to either side times `lever`, m/rad, which the
model states. A clearance moves the two flanks apart; an interference moves them together, so that both carry load near
the middle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..display import dataframe, html_table
from ..errors import InputError, expect, expect_number, refuse_unknown
from ..numerics.arrays import Array
from ..numerics.bspline import Axis
from ..numerics.piecewise_line import PiecewiseLine, QuadraticSpline
from ..units import ARCMIN
from .table import QUANTITIES, Lookup

NOMINAL_LEVER = 0.01
"""m/rad, lever where no drawing gives it. A convention: results are stated as play, which does not depend on it."""
CURVE_FIELDS = ("name", "ratio", "lever [m/rad]", "twist [rad]", "torque [N.m]")
"""Fields of `Lookup.drawing["curve"]` and of the section [curve] of model.toml."""
_NODES, _CLEARANCES = 240, 24
"""Cells of the axes, at whose nodes pictures and data frames are evaluated; chosen by judgement."""


@dataclass(frozen=True)
class CurveLookup(Lookup):
    """A lookup whose torque is linear between the points of a curve, the corners rounded as in `piecewise_line`.

    The curve is `drawing["curve"]`; `drawing["drive"]` is the drawing of the drive that states it, where there is one.
    It has one curve and no band, and neither contact forces nor load shares.
    """

    @property
    def curve(self) -> Mapping[str, Any]:
        """The fields `CURVE_FIELDS`."""
        return self.drawing["curve"]

    @property
    def has_contacts(self) -> bool:
        return False

    @property
    def drive_table(self) -> Mapping[str, Any] | None:
        return self.drawing.get("drive")

    @cached_property
    def line(self) -> PiecewiseLine:
        """The curve without rounding."""
        return PiecewiseLine.through(self.curve["twist [rad]"], self.curve["torque [N.m]"])

    @cached_property
    def flanks(self) -> tuple[QuadraticSpline, QuadraticSpline]:
        """The torques that the flanks for positive and negative twist add to that at zero twist."""
        return self.line.flank(1), self.line.flank(-1)

    @property
    def lever(self) -> float:
        """Clearance over the twist that it frees, m/rad."""
        return float(self.curve["lever [m/rad]"])

    def evaluate(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> tuple[Array, Array, Array]:
        """Torque, N.m, and its derivatives by twist, N.m/rad, and clearance, N, at points that broadcast."""
        held = np.clip(clearance, self.clearance.start, self.clearance.stop)
        x, play = np.asarray(twist, float), held / self.lever
        (right, by_right), (left, by_left) = self.flanks[0].evaluate(x - play), self.flanks[1].evaluate(x + play)
        moves = held == np.asarray(clearance, float)
        return float(self.line.at(0.0)) + right + left, by_right + by_left, moves * (by_left - by_right) / self.lever

    def torque(self, twist: ArrayLike, clearance: ArrayLike = 0.0, band: ArrayLike = 0.0) -> Array:
        return self.evaluate(twist, clearance)[0] + np.zeros_like(band, float)

    def stiffness(self, twist: ArrayLike, clearance: ArrayLike = 0.0, band: ArrayLike = 0.0) -> Array:
        return self.evaluate(twist, clearance)[1] + np.zeros_like(band, float)

    def max_contact_force(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> Array:
        raise InputError(
            f"{self.curve['name']}: expected a drive with contacts, got a curve, which has no contact force"
        )

    def load_share(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> Array:
        raise InputError(f"{self.curve['name']}: expected a drive with contacts, got a curve, which has no load share")

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each point of the curve. Raises `InputError` without pandas."""
        return dataframe({"twist [arcmin]": self.line.twist / ARCMIN, "torque [N.m]": self.line.torque})

    def _repr_html_(self) -> str:
        rows = {
            "twist [arcmin]": f"+-{self.twist.stop / ARCMIN:.4g}, {len(self.line.twist)} points",
            "full torque [N.m]": f"{self.full_torque:.4g}",
        }
        return html_table(self.curve["name"], rows)

    @property
    def maximum_stiffness(self) -> float:
        """Greatest stiffness of a line, N.m/rad."""
        return float(self.line.slopes.max())

    def __repr__(self) -> str:
        return f"CurveLookup({self.curve['name']!r}, {len(self.line.twist)} points, {self.full_torque:.4g} N.m)"


def curve_lookup(
    twist: ArrayLike,
    torque: ArrayLike,
    lever: float,
    name: str,
    ratio: float | None,
    drive: Mapping[str, Any] | None = None,
) -> CurveLookup:
    """A curve as a lookup.

    twist: (n,) rad, increasing; torque: (n,) N.m; lever: m/rad; ratio: signed, crank to output; None where it is
    unknown, because the crank was locked. A curve on one side of zero twist is continued as an odd function. drive: the
    drawing of the drive that states the curve.

    >>> curve = curve_lookup([0.0, 1e-3, 2e-3], [0.0, 5.0, 12.0], 0.01, "spring", -50)
    >>> curve.torque([1.5e-3, 1.5e-3], [0.0, 5e-6]).round(3).tolist()
    [8.5, 5.0]
    """
    x, y = np.asarray(twist, float), np.asarray(torque, float)
    source = {
        "name": name,
        **({} if ratio is None else {"ratio": ratio}),
        "lever [m/rad]": float(lever),
        "twist [rad]": x.tolist(),
        "torque [N.m]": y.tolist(),
    }
    reach = float(np.abs(x).max())
    widest = 0.5 * reach * lever
    return CurveLookup(
        Axis(-reach, 2 * reach / _NODES, _NODES),
        Axis(-widest, 2 * widest / _CLEARANCES, _CLEARANCES),
        np.zeros((len(QUANTITIES), 0, 0)),
        float(np.abs(y).max()),
        dict.fromkeys(QUANTITIES, 0.0),
        {"curve": source} if drive is None else {"curve": source, "drive": dict(drive)},
        1,
        0,
        "",
    )


def curve_lookup_from_dict(curve: Mapping[str, Any], where: str, drive: Mapping[str, Any] | None = None) -> CurveLookup:
    """The lookup of a section [curve]. Raises `InputError` for other fields and values that are no curve."""
    refuse_unknown("field", curve, CURVE_FIELDS, where)
    if "ratio" not in curve:
        raise InputError(
            f"{where}: expected the field 'ratio', crank to output with its sign, got none, since the diagnosed record "
            "does not show it; add it to the file, or export with --set ratio=..."
        )
    for name in CURVE_FIELDS:
        expect(name in curve, f"a field {name!r}", sorted(curve), where)
    expect(isinstance(curve["name"], str), "a name", curve["name"], where)
    ratio = expect_number(curve["ratio"], "a finite ratio", f"{where}: ratio")
    expect(ratio != 0, "a ratio that is not zero", ratio, where)
    lever = expect_number(curve["lever [m/rad]"], "a lever above zero", f"{where}: lever", low=0)
    try:
        twist, torque = (np.array(curve[name], float) for name in ("twist [rad]", "torque [N.m]"))
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: expected numbers, got {error}") from None
    expect_curve(twist, torque, where)
    return curve_lookup(twist, torque, lever, curve["name"], ratio, drive)


def curve_lookup_from_drawing(drawing: Mapping[str, Any], where: str) -> CurveLookup:
    """The lookup of `CurveLookup.drawing`, as it was saved. Raises `InputError`."""
    curve, drive = drawing["curve"], drawing.get("drive")
    expect(isinstance(curve, Mapping), "a table of a curve", curve, f"{where}: curve")
    expect(drive is None or isinstance(drive, Mapping), "the table of a drawing", drive, f"{where}: drive")
    return curve_lookup_from_dict(curve, f"{where}: curve", drive)


def expect_curve(twist: NDArray[Any], torque: NDArray[Any], where: str, least: int = 3) -> None:
    """Raise `InputError` unless twist (n,) and torque (n,) are at least `least` points of a curve."""
    expect(
        twist.ndim == 1 and len(twist) >= least and twist.shape == torque.shape,
        f"as many torques as twists, {least} or more",
        f"{torque.size} torques and {twist.size} twists",
        where,
    )
    expect(
        bool(np.isfinite(twist).all() and np.isfinite(torque).all() and (np.diff(twist) > 0).all()),
        "finite numbers and increasing twists",
        "others",
        where,
    )
