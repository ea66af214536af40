"""Where the gap lies: which coordinate explains how much of a residual, and in which region."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN

from ..estimation.problem import Problem
from ..schema import Location

BINS, FINE_BINS = 10, 40
"""Groups along a coordinate; along the twist, where teeth and play show."""
FINER = 0.1
"""Share by which the twist must beat the torque, or the place is given in torque."""
MOST_ORDER = 6


def block_coordinates(problem: Problem) -> dict[str, tuple[Array, str]]:
    """Coordinates of the blocks that vary in this record, with their units."""
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


def locate_gap(problem: Problem, residual: Array, systematic: float) -> tuple[Location, ...]:
    """Places of a residual (n,), N.m, whose systematic mean square is `systematic`; the greatest shares first."""
    if systematic <= 0:
        return ()
    values = block_coordinates(problem)
    direction = np.sign(problem.blocks.mean(problem.trace.twist_rate))
    noise = problem.variance
    found: list[Location] = []
    for name, (x, unit) in values.items():
        groups = _bins(x, FINE_BINS if name == "twist" else BINS)
        found.append(_place(name, groups, residual, noise, systematic, x, unit))
    shares = {p.coordinate: p.share for p in found}
    if shares.get("twist", 0.0) < shares.get("torque", 0.0) + FINER:
        found = [p for p in found if p.coordinate != "twist"]
    load = _bins(problem.torque)
    side = load * 3 + (direction + 1).astype(int)
    odd = residual - _means(load, residual)[load]
    found.append(_place("direction", side, odd, noise, systematic, problem.torque, "N.m", direction))
    crank = problem.blocks.mean(problem.trace.crank)
    if np.ptp(crank) > 0.5:
        found.append(_orders(crank, residual, noise, systematic))
    return tuple(sorted((p for p in found if p.share > 0.02), key=lambda p: -p.share))


def _bins(x: Array, count: int = BINS) -> NDArray[np.intp]:
    edges = np.unique(np.quantile(x, np.linspace(0, 1, count + 1)))
    return np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))


def _means(groups: NDArray[np.intp], values: Array) -> Array:
    count = np.maximum(np.bincount(groups), 1)
    return np.bincount(groups, values) / count


def _place(
    name: str,
    groups: NDArray[np.intp],
    residual: Array,
    noise: Array,
    systematic: float,
    x: Array,
    unit: str,
    direction: Array | None = None,
) -> Location:
    count = np.bincount(groups).astype(float)
    mean = _means(groups, residual)
    # What the noise alone puts into the means does not count.
    energy = np.maximum(count * mean**2 - np.bincount(groups, noise) / np.maximum(count, 1), 0.0)
    share = float(min(1.0, energy.sum() / (systematic * len(residual))))
    strongest = int(np.where(count > 0, energy, -1.0).argmax())
    inside = groups == strongest
    low, high = float(x[inside].min()), float(x[inside].max())
    region = f"{low:.3g} to {high:.3g} {unit}"
    if direction is not None:
        going = float(direction[inside].mean())
        words = "twist growing" if going > 0.3 else "twist falling" if going < -0.3 else "at rest"
        region = f"{words}, {region}"
    return Location(name, region, share)


def _orders(crank: Array, residual: Array, noise: Array, systematic: float) -> Location:
    """Share of the residual in the crank's orders, and the strongest of them."""
    n = len(residual)
    energy = {}
    for order in range(1, MOST_ORDER + 1):
        wave = np.stack([np.cos(order * crank), np.sin(order * crank)], axis=1)
        amplitude = np.linalg.lstsq(wave, residual, rcond=None)[0]
        energy[order] = max(0.0, float(((wave @ amplitude) ** 2).sum()) - 2 * float(noise.mean()))
    strongest = max(energy, key=lambda k: energy[k])
    return Location("crank_angle", f"order {strongest} of the crank", min(1.0, sum(energy.values()) / (systematic * n)))
