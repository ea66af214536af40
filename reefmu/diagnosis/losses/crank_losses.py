"""Friction at the crank from the torques of crank and output, with intervals that count what cycles differ by.

The motor's torque less that of the output over the ratio, U, is fitted by linear least squares as

    T_m - U = offset + (scale - 1) U + s (torque + fraction |U|) + viscous w

with the crank's speed w and its sign s: the law of the effect `crank_friction`, whose parameters are not negative,
beside what is wrong with the sensors. An offset of either sensor does not turn with the motion. An error of the torque
constant or of a sensor's scale grows with the load whichever way the power flows, and friction is against the motion,
so that both are told apart where the crank drives and is driven. What the motion of a record does not separate is left
out, and the result says so.

Each cycle is left out in turn. The spread of the estimates (jackknife: Wolter, Introduction to Variance Estimation, 2nd
ed. 2007, section 4.2) holds all in which cycles differ, whatever its correlation within a cycle; Student's quantile
counts their number. The form of the law adds what it adds to every parameter of a diagnosis; friction in proportion to
the load here follows the torque at the output, which differs from the elastic torque of the effect by the friction
inside the drive. What all cycles share is not in it: cogging, friction that changes from day to day.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from operator import itemgetter

import numpy as np
from scipy.special import stdtrit

from stiffness_model.numerics.arrays import Array

from ...effects import FORM_UNCERTAINTY
from ...record import Record
from ..estimation.intervals import CONFIDENCE
from ..fitted_values import CrankLosses, EfficiencyAtLoad, Value
from .sliding_samples import LEAST, SlidingSamples, sliding_samples

LAW = {"torque": "N.m", "fraction": "1", "viscous": "N.m.s/rad"}
"""Parameters of the effect `crank_friction` that are estimated, none of them negative, and their units."""
CRANK_FRICTION = "crank_friction"
"""The effect of friction at the crank, which is no candidate: the torques of crank and output show it, or nothing."""
MIN_SAMPLES = 100
"""Least number of samples, as of a record that is diagnosed."""
MIN_SPREAD = 2.0
"""90th percentile of loads or speeds, over the 10th, from which on their influence is fitted. Chosen by judgement: over
an octave a part in proportion changes by half of what it is at the top."""
MIN_SHARE = 0.1
"""Share of the samples of the rarer direction of motion, or of power, from which on both count as present. Chosen by
judgement."""
MAX_GROUPS = 24
"""Groups of replicates that are left out at most, as many as cycles of a diagnosis: they give a standard error within a
seventh of its size."""
OPPOSED = -0.5
"""Correlation of both torques below which one has the wrong sign, as that of torque and twist."""
FULL_LOAD = 0.95
"""Quantile of the loads that counts as full load. Chosen by judgement, so that no peak decides."""


def crank_losses(record: Record, ratio: float | None) -> CrankLosses | str:
    """The losses of a record with the torques of crank and output, or the reason why it shows none.

    ratio: signed, crank to output; None where it is not known.
    """
    if record.crank_torque is None:
        return "the record holds one torque"
    if ratio is None:
        return "the transmission ratio is not known, since a shaft is locked: state the drive"
    if np.ptp(record.crank_angle) == 0:
        return "the crank does not turn"
    if np.corrcoef(record.crank_torque, record.output_torque / ratio)[0, 1] < OPPOSED:
        return "the motor's torque falls as that of the output grows: one of them has the wrong sign"
    samples = sliding_samples(record, ratio)
    if len(samples.load) < MIN_SAMPLES or samples.replicates < LEAST:
        return (
            f"the crank slides in {len(samples.load)} samples of {samples.replicates} {samples.kind}; {MIN_SAMPLES} of "
            f"{LEAST} are needed"
        )
    return _estimate(samples, abs(ratio))


def with_losses(excluded: Mapping[str, str], losses: CrankLosses | str) -> dict[str, str]:
    """Effects that a record cannot show, with the reason by name: without friction at the crank where the torques of
    both ends show it, else with the reason why they do not."""
    others = {name: reason for name, reason in excluded.items() if name != CRANK_FRICTION}
    if isinstance(losses, str):
        others[CRANK_FRICTION] = f"both torques are measured, but {losses}"
    return others


def _estimate(samples: SlidingSamples, ratio: float) -> CrankLosses:
    columns, assumptions = _columns(samples)
    names, design = tuple(columns), np.stack(list(columns.values()), axis=1)
    group = samples.replicate * min(MAX_GROUPS, samples.replicates) // samples.replicates
    members = [group == k for k in np.unique(group)]
    squares = np.array([design[m].T @ design[m] for m in members])
    products = np.array([design[m].T @ samples.excess[m] for m in members])
    bounded = np.array([name in LAW for name in names])
    whole = _solve(squares.sum(axis=0), products.sum(axis=0), bounded)
    # Estimates that are held at a bound would not differ: the spread is that of estimates without bounds.
    without = np.array(
        [_solve(squares.sum(axis=0) - a, products.sum(axis=0) - b) for a, b in zip(squares, products, strict=True)]
    )

    def value(
        quantity: Callable[[dict[str, float]], float],
        unit: str,
        low: float = -np.inf,
        high: float = np.inf,
        ideal: float = 0.0,
    ) -> Value:
        at = quantity(dict(zip(names, whole.tolist(), strict=True)))
        spread = np.array([quantity(dict(zip(names, row, strict=True))) for row in without.tolist()])
        m = len(spread)
        error = np.sqrt((m - 1) / m * float(((spread - spread.mean()) ** 2).sum()))
        form = FORM_UNCERTAINTY * abs(at - ideal)
        half = float(stdtrit(m - 1, 0.5 + CONFIDENCE / 2) * np.hypot(error, form))
        return Value(at, max(at - half, low), min(at + half, high), unit)

    sensors = {"offset": value(itemgetter("offset"), "N.m")} if "offset" in names else {}
    if "scale" in names:
        sensors["scale"] = value(lambda p: 1 + p["scale"], "1")
    residual = samples.excess - design @ whole
    full, speed = float(np.quantile(np.abs(samples.load), FULL_LOAD)), float(np.median(np.abs(samples.speed)))
    efficiencies = [
        EfficiencyAtLoad(
            load * ratio,
            speed,
            value(lambda p, u=load: u / (u + _loss(p, u, speed)), "1", 0.0, 1.0, 1.0),
            value(lambda p, u=load: 1 - _loss(p, u, speed) / u, "1", -np.inf, 1.0, 1.0),
        )
        for load in (0.5 * full, full)
        if load > 0
    ]
    return CrankLosses(
        {name: value(itemgetter(name), unit, low=0.0) for name, unit in LAW.items() if name in names},
        sensors,
        tuple(efficiencies),
        _loss(dict(zip(names, whole.tolist(), strict=True)), full, speed),
        float(np.sqrt(np.mean(samples.excess**2))),
        float(np.sqrt(np.mean(residual**2))),
        samples.replicates,
        samples.kind,
        tuple(assumptions),
    )


def _loss(parameters: dict[str, float], load: float, speed: float) -> float:
    """N.m at the crank, of a load at the crank, N.m, and a speed, rad/s."""
    torque, fraction, viscous = (parameters.get(name, 0.0) for name in LAW)
    return torque + fraction * load + viscous * speed


def _columns(samples: SlidingSamples) -> tuple[dict[str, Array], list[str]]:
    """The columns (n,) of the fit that the record separates, by name, and what is assumed of the others."""
    load, direction, assumptions = samples.load, samples.direction, list[str]()
    columns = {"torque": direction}
    loads, speeds = _is_spread(np.abs(load)), _is_spread(np.abs(samples.speed))
    if loads:
        columns["fraction"] = direction * np.abs(load)
    else:
        assumptions.append(
            "the load hardly changes: how friction grows with it is not known, and it counts as constant"
        )
    if speeds:
        columns["viscous"] = samples.speed
    else:
        assumptions.append("the speed hardly changes: viscous friction counts as dry")
    if _has_both(direction):
        columns["offset"] = np.ones(len(load))
    else:
        assumptions.append("the crank turns one way: the zeros of both torques are taken as exact")
    if loads and _has_both(direction * np.sign(load)):
        columns["scale"] = load
    else:
        assumptions.append(
            "power flows one way, or the load hardly changes: the torque constant and the scales of both torques are "
            "taken as exact"
        )
    return columns, assumptions


def _is_spread(values: Array) -> bool:
    low, high = np.quantile(values, [0.1, 0.9])
    return bool(high > MIN_SPREAD * low and high > 0)


def _has_both(sign: Array) -> bool:
    return min(float(np.mean(sign > 0)), float(np.mean(sign < 0))) >= MIN_SHARE


def _solve(squares: Array, products: Array, bounded: Array | None = None) -> Array:
    """The parameters (k,) of least squares with these normal equations, of which those `bounded` are not negative.

    The minimum of a convex function under bounds is the best of the feasible minima with some of them at their bound.

    >>> _solve(np.eye(2), np.array([-1.0, 2.0]), np.array([True, False])).tolist()
    [0.0, 2.0]
    """
    scale = np.sqrt(np.maximum(np.diag(squares), 1e-300))
    matrix, vector = squares / scale / scale[:, None], products / scale
    limited = np.array([], int) if bounded is None else np.flatnonzero(bounded)
    best, least = np.zeros(len(vector)), np.inf
    for count in range(len(limited) + 1):
        for zeros in itertools.combinations(limited.tolist(), count):
            free = np.setdiff1d(np.arange(len(vector)), zeros)
            found = np.zeros(len(vector))
            found[free] = np.linalg.lstsq(matrix[np.ix_(free, free)], vector[free], rcond=None)[0]
            cost = float(0.5 * found @ matrix @ found - vector @ found)
            if (found[limited] >= 0).all() and cost < least:
                best, least = found, cost
    return best / scale
