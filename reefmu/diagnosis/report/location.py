"""Where a gap lies: which coordinates explain how much of a residual, and in which region each is strongest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN

from ..estimation.problem import Problem
from ..schema import Location

N_BINS, N_TWIST_BINS = 10, 40
"""Groups of blocks along a coordinate, and along the twist, where a ripple or play needs finer ones; by judgement."""
TWIST_MARGIN = 0.1
"""Share by which the twist must explain more than the torque to be given beside it; chosen by judgement."""
MAX_ORDER = 6
"""Highest order of the crank that is looked for; chosen by judgement."""
MIN_SHARE = 0.02
"""Smallest share of a gap that is reported; chosen by judgement."""
MIN_DIRECTION = 0.3
"""Mean sign of the twist's rate above which a group of blocks counts as moving; chosen by judgement."""
MIN_TURN = 0.5
"""Smallest range of the crank angle, rad, that shows orders; chosen by judgement."""


def block_coordinates(problem: Problem) -> dict[str, tuple[Array, str]]:
    """Values (n,) at the blocks, and units, of the coordinates that vary in this record."""
    t, mean = problem.trace, problem.blocks.mean
    travel = np.cumsum(np.abs(np.diff(t.crank, prepend=t.crank[0])))
    torque = problem.torque
    found = {
        "torque": (torque, "N.m"),
        "time": (mean(t.time), "s"),
        "rate": (mean(t.twist_rate) * 1e3, "mrad/s"),
        "speed": (mean(t.output_speed) * 1e3, "mrad/s at the output"),
        "temperature": (mean(t.temperature), "degC"),
        "travel": (mean(travel), "rad of the crank"),
        "twist": (mean(t.twist) / ARCMIN, "arcmin"),
    }
    return {name: v for name, v in found.items() if np.ptp(v[0]) > 1e-9 * (1 + np.abs(v[0]).max())}


@dataclass(frozen=True)
class _Residual:
    """values: (n,) N.m; noise: (n,) (N.m)^2, variance of the noise; systematic: (N.m)^2, mean square without the
    noise."""

    values: Array
    noise: Array
    systematic: float

    def share(self, energy: float) -> float:
        """Share of the systematic part that a sum of squares, (N.m)^2, makes up."""
        return float(min(1.0, energy / (self.systematic * len(self.values))))


def locate_gap(problem: Problem, residual: Array, systematic: float) -> tuple[Location, ...]:
    """Locations of a residual (n,), N.m, the largest share first; systematic: (N.m)^2, its mean square without
    noise."""
    if systematic <= 0:
        return ()
    whole = _Residual(residual, problem.variance, systematic)
    found: list[Location] = []
    for name, (x, unit) in block_coordinates(problem).items():
        share, inside = _strongest_group(whole, _bins(x, N_TWIST_BINS if name == "twist" else N_BINS))
        found.append(Location(name, _region(x[inside], unit), share))
    shares = {p.coordinate: p.share for p in found}
    if shares.get("twist", 0.0) < shares.get("torque", 0.0) + TWIST_MARGIN:
        found = [p for p in found if p.coordinate != "twist"]
    found.append(_locate_direction(problem, whole))
    crank = problem.blocks.mean(problem.trace.crank)
    if np.ptp(crank) > MIN_TURN:
        found.append(_locate_orders(crank, whole))
    return tuple(sorted((p for p in found if p.share > MIN_SHARE), key=lambda p: -p.share))


def _bins(x: Array, count: int = N_BINS) -> NDArray[np.intp]:
    """Number of the group (n,) of equally many blocks along x (n,)."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, count + 1)))
    return np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))


def _group_means(groups: NDArray[np.intp], values: Array) -> Array:
    count = np.maximum(np.bincount(groups), 1)
    return np.bincount(groups, values) / count


def _strongest_group(residual: _Residual, groups: NDArray[np.intp]) -> tuple[float, NDArray[np.bool_]]:
    """Share of the residual in the means of the groups, and the blocks (n,) of the strongest group."""
    count = np.bincount(groups).astype(float)
    mean = _group_means(groups, residual.values)
    # Without the part that noise alone contributes to the means.
    energy = np.maximum(count * mean**2 - np.bincount(groups, residual.noise) / np.maximum(count, 1), 0.0)
    strongest = int(np.where(count > 0, energy, -1.0).argmax())
    return residual.share(float(energy.sum())), groups == strongest


def _region(values: Array, unit: str) -> str:
    return f"{float(values.min()):.3g} to {float(values.max()):.3g} {unit}"


def _locate_direction(problem: Problem, residual: _Residual) -> Location:
    """The part that depends on the direction of the twist at the same torque."""
    direction = np.sign(problem.blocks.mean(problem.trace.twist_rate))
    load = _bins(problem.torque)
    odd = residual.values - _group_means(load, residual.values)[load]
    groups = load * 3 + (direction + 1).astype(int)
    share, inside = _strongest_group(replace(residual, values=odd), groups)
    mean = float(direction[inside].mean())
    words = "twist growing" if mean > MIN_DIRECTION else "twist falling" if mean < -MIN_DIRECTION else "at rest"
    return Location("direction", f"{words}, {_region(problem.torque[inside], 'N.m')}", share)


def _locate_orders(crank: Array, residual: _Residual) -> Location:
    """The part in the orders of the crank, rad (n,), and the strongest of them."""
    energy: dict[int, float] = {}
    for order in range(1, MAX_ORDER + 1):
        wave = np.stack([np.cos(order * crank), np.sin(order * crank)], axis=1)
        amplitude = np.linalg.lstsq(wave, residual.values, rcond=None)[0]
        energy[order] = max(0.0, float(((wave @ amplitude) ** 2).sum()) - 2 * float(residual.noise.mean()))
    strongest = max(energy, key=lambda k: energy[k])
    return Location("crank_angle", f"order {strongest} of the crank", residual.share(sum(energy.values())))
