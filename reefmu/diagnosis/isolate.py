"""Isolability: before anything is fitted, what this excitation cannot show and what it cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit import Fit
from .kernels import kernel
from .scores import Direction, projector
from .study import Study

Array = NDArray[np.float64]

NO_TRACE = 0.03
"""Share of a candidate's trace that the base parameters must leave, or it is called invisible."""
TWIN_ANGLE = 0.995
"""Cosine of the angle between two traces above which they are twins."""

SPLITS: dict[frozenset[str], str] = {
    frozenset({"backlash", "preload"}): "load the drive in both directions through zero torque",
    frozenset({"coulomb_friction", "viscous_friction"}): "rotate at three speeds, a decade apart, both ways",
    frozenset({"coulomb_friction", "stribeck_friction"}): "rotate from creeping to several times the turn-over speed",
    frozenset({"coulomb_friction", "hysteresis"}): "rotate the output both ways under load; with the "
                                                  "crank locked the two are one",
    frozenset({"stribeck_friction", "hysteresis"}): "rotate the output both ways at several speeds under load",
    frozenset({"structural_compliance", "modulus_error"}): "loops to several torque levels up to full torque; on a "
                                                           "plastic drive measure the housing's give separately",
    frozenset({"creep", "structural_compliance"}): "hold the torque for five time constants, and rest as long after it",
    frozenset({"creep", "damping"}): "hold the torque for five time constants, and loop at three rates a decade apart",
    frozenset({"hysteresis", "load_dependent_hysteresis"}): "loops of several amplitudes, through zero torque",
    frozenset({"damping", "hysteresis"}): "the same loops at three rates, a decade apart",
    frozenset({"damping", "viscous_friction"}): "rotate at constant twist, and loop with the crank locked",
    frozenset({"torque_sensor_offset", "torque_sensor_drift"}): "an unloaded reading at the beginning and the end",
    frozenset({"thermal_clearance", "wear"}): "the same loops cold, warm and cold again",
    frozenset({"missing_ball", "kinematic_error"}): "turn the crank slowly at two constant twists",
}
_ALONE = {
    "kinematic_error": "loops at four or more crank angles over a turn",
    "missing_ball": "slow turns of the crank at constant twist",
    "torque_sensor_offset": "a reading of the unloaded drive, turned round as well",
    "torque_sensor_drift": "unloaded readings at the beginning and the end of a long record",
}


@dataclass(frozen=True)
class Isolability:
    """invisible: candidates without a trace, with the reason; twins: pairs that this record cannot tell apart."""

    invisible: dict[str, str]
    twins: tuple[tuple[str, str], ...]


def isolability(study: Study, base: Fit, traces: dict[str, list[Direction]]) -> Isolability:
    """From linearised traces of all candidates under the noise alone."""
    weights = study.weights.with_size(0.0)
    basis = projector(weights, base.prediction.sensitivities)
    visible: dict[str, list[Array]] = {}
    invisible = {}
    for name, variants in traces.items():
        kept = []
        for direction in variants:
            white = weights.white(direction.columns)
            rest = white - basis @ (basis.T @ white)
            sizes = [kernel(name).effect.parameters[k].nominal for k in direction.sizes]
            nominal = np.array(sizes * (2 if direction.paired else 1))
            if np.linalg.norm(white) > 0 and np.linalg.norm(rest) > NO_TRACE * np.linalg.norm(white):
                kept.append(np.linalg.qr(rest * nominal)[0][:, :1] if rest.shape[1] == 1 else _span(rest * nominal))
        if kept:
            visible[name] = kept
        else:
            invisible[name] = "leaves no trace in this record; it would take: " + wanted(name)
    names = list(visible)
    twins = []
    for i, first in enumerate(names):
        for second in names[i + 1:]:
            if {first, second} == {"backlash", "preload"}:
                continue  # one quantity; the sign that fits is the name
            like = max(_alike(a, b) for a in visible[first] for b in visible[second])
            if like > TWIN_ANGLE:
                twins.append((first, second))
    return Isolability(invisible, tuple(twins))


def _span(columns: Array) -> Array:
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return u[:, s > 1e-3 * max(float(s[0]), 1e-300)]


def _alike(a: Array, b: Array) -> float:
    """Cosine of the greatest angle between the smaller of two spaces and the other."""
    small = min(a.shape[1], b.shape[1])
    if a.shape[1] != b.shape[1] and max(a.shape[1], b.shape[1]) > 2:
        return 0.0
    return float(np.linalg.svd(a.T @ b, compute_uv=False)[:small].min(initial=1.0))


def wanted(name: str) -> str:
    """What a test must do to show an effect."""
    return kernel(name).effect.excitation.rstrip(".").lower() if name not in _ALONE else _ALONE[name]


def splitting(sets: Sequence[Sequence[str]]) -> list[str]:
    """Experiments that tell the sets apart, one for each pair of effects in which they differ."""
    found: list[str] = []
    best = set(sets[0])
    for other in sets[1:]:
        mine, theirs = best - set(other), set(other) - best
        for a in sorted(mine) or sorted(best):
            for b in sorted(theirs):
                text = SPLITS.get(frozenset({a, b}), f"{wanted(a)}; and {wanted(b)}")
                line = f"{a} or {b}: {text}"
                if line not in found:
                    found.append(line)
    return found[:6]
