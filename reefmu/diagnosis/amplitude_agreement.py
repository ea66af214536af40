"""Whether small and large cycles show the same size of an effect, tested by what cycles of one amplitude differ by.

The size of each effect is estimated in every cycle by itself, to first order about the fit of the whole record and with
all other parameters held. Cycles of one amplitude are replicates: their scatter, whatever its correlation within a
cycle, gives the error of the mean size at that amplitude, and Welch's test (Biometrika 38, 1951) compares the means.
Where they disagree, sizes in proportion to a power of the torque's amplitude would reconcile them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, stdtrit

from stiffness_model.numerics.arrays import Array

from ..effects import find_effect
from .estimation.least_squares import Fit
from .estimation.problem import Problem
from .estimation.score_test import amplitudes
from .fitted_values import AmplitudeSize, AmplitudeTest
from .preprocessing.cycles import Cycles

ALIKE = 0.2
"""Relative difference of the amplitudes of two kinds of cycles within which they count as one. Chosen by judgement,
twice that within which branches repeat each other."""
MIN_BLOCKS = 8
"""Least number of blocks of a cycle in which a size is estimated. Chosen by judgement."""
LAWS = {
    0.0: "the law as it is",
    1.0: "a size in proportion to the torque's amplitude",
    2.0: "a size in proportion to the square of the amplitude, as of loops within the presliding range",
}
"""Powers of the torque's amplitude by which a size may grow beyond its law: not at all; load-dependent friction; and
Rayleigh's law of loops that stay within presliding."""
MIXTURE = "two parts, one as the law says and one in proportion to the amplitude, or presliding over a longer twist"
"""What a power between 0 and 1 stands for."""


def compare_amplitudes(problem: Problem, fit: Fit) -> tuple[AmplitudeTest, ...]:
    """A test for each effect of a fit; none where cycles of two amplitudes are not repeated."""
    cycles = problem.cycles
    if cycles is None:
        return ()
    groups = _amplitude_groups(cycles)
    if len(groups) < 2:
        return ()
    found = [test for name in fit.names if (test := _compare(problem, fit, name, cycles, groups)) is not None]
    return tuple(found)


def _amplitude_groups(cycles: Cycles) -> list[list[int]]:
    """Numbers of the cycles by their amplitude, smallest first; those of one cycle are left out."""
    order = np.argsort(cycles.amplitude).tolist()
    groups: list[list[int]] = []
    for k in order:
        if groups and cycles.amplitude[k] <= (1 + ALIKE) * cycles.amplitude[groups[-1][0]]:
            groups[-1].append(k)
        else:
            groups.append([k])
    return [group for group in groups if len(group) > 1]


def _compare(problem: Problem, fit: Fit, name: str, cycles: Cycles, groups: list[list[int]]) -> AmplitudeTest | None:
    effect = find_effect(name)
    sizes = amplitudes(effect)
    if len(sizes) != 1 or any(p.name.startswith("phase") for p in effect.parameters):
        return None
    parameter = effect.parameters[sizes[0]]
    if parameter.unit.startswith("m") and problem.base.kind != "drawing":
        # A clearance without a drawing is no length, and its sizes in small cycles depend on where they begin.
        return None
    at = problem.layout(fit.names).effects[name].start + sizes[0]
    values = [np.array([_size_in_cycle(problem, fit, at, cycles.number == k) for k in group]) for group in groups]
    values = [part[np.isfinite(part)] for part in values]
    if any(len(part) < 2 for part in values):
        return None
    levels = np.array([float(np.mean(cycles.amplitude[group])) for group in groups])
    p = min(1.0, len(fit.names) * welch_p(values))
    power = _power(levels[[0, -1]], values[0], values[-1])
    laws: tuple[str, ...] = ()
    if power is not None:
        laws = tuple(text for exponent, text in LAWS.items() if power[1] <= exponent <= power[2])
        if not laws and power[1] > 0 and power[2] < 1:
            laws = (MIXTURE,)
    found = tuple(_mean_size(level, part) for level, part in zip(levels.tolist(), values, strict=True))
    return AmplitudeTest(name, parameter.name, parameter.unit, found, p, *(power or (None, None, None)), laws)


def _size_in_cycle(problem: Problem, fit: Fit, at: int, inside: NDArray[np.bool_]) -> float:
    """The size of the parameter at an index of the fit in the blocks `inside` (n,); NaN where they do not show it."""
    column = fit.prediction.sensitivities[inside, at]
    energy = float(column @ column)
    whole = float(np.mean(fit.prediction.sensitivities[:, at] ** 2))
    if inside.sum() < MIN_BLOCKS or energy <= 1e-6 * whole * inside.sum():
        return float("nan")
    rest = (problem.torque - fit.prediction.torque)[inside]
    return float(fit.parameters[at]) + float(column @ rest) / energy


def _mean_size(amplitude: float, values: Array) -> AmplitudeSize:
    count = len(values)
    half = float(stdtrit(count - 1, 0.975)) * float(values.std(ddof=1)) / count**0.5
    mean = float(values.mean())
    return AmplitudeSize(amplitude, mean, mean - half, mean + half, count)


def welch_p(groups: list[Array]) -> float:
    """p-value of Welch's test that groups of at least two values each have one mean.

    >>> round(welch_p([np.array([1.0, 1.2, 0.9]), np.array([1.1, 1.0, 1.3])]), 2)
    0.47
    >>> welch_p([np.array([2.6, 2.5, 2.7]), np.array([5.8, 5.9, 5.6])]) < 1e-4
    True
    """
    k, n = len(groups), np.array([len(g) for g in groups], float)
    mean = np.array([g.mean() for g in groups])
    # Values that do not scatter at all still have rounding errors.
    error = np.maximum([g.var(ddof=1) for g in groups], 1e-24 * max(float(np.abs(mean).max()), 1e-150) ** 2) / n
    weight = 1 / error
    share = weight / weight.sum()
    centre = float(share @ mean)
    spread = float(((1 - share) ** 2 / (n - 1)).sum())
    statistic = float(weight @ (mean - centre) ** 2) / (k - 1) / (1 + 2 * (k - 2) * spread / (k**2 - 1))
    return float(fdtrc(k - 1, (k**2 - 1) / (3 * spread), statistic))


def _power(levels: Array, small: Array, large: Array) -> tuple[float, float, float] | None:
    """Power of the amplitude with which a size grows between two levels (2,), and its 95 % interval; None for sizes
    that are not positive."""
    first, last = float(small.mean()), float(large.mean())
    if first <= 0 or last <= 0:
        return None
    ratio = float(np.log(levels[1] / levels[0]))
    parts = np.array([part.var(ddof=1) / len(part) / part.mean() ** 2 for part in (small, large)])
    freedom = np.array([len(small) - 1, len(large) - 1])
    whole = max(float(parts.sum()), 1e-30)
    half = float(stdtrit(whole**2 / max(float((parts**2 / freedom).sum()), 1e-60), 0.975)) * whole**0.5 / ratio
    power = float(np.log(last / first)) / ratio
    return power, power - half, power + half
