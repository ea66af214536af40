"""Other methods on the same physics: greedy BIC, STLSQ and pysindy over linear columns of the effects.

Each takes a record and a drawing and returns verdict and names in the form of diagnosis.json. None accounts for
tolerance scatter or for discrepancies that no effect describes. "bic" is the plain criterion. The others get help: an
effect must change the torque by `MATERIAL`, and "bic_helped" counts independent samples only.
"""

from __future__ import annotations

import functools
import importlib.util
import itertools
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import stiffness_model as sm
from reefmu.record import Record, read_record
from stiffness_model.lookup.build_lookup import Lookup, build_lookup
from stiffness_model.numerics.arrays import Array

MICROMETRE = 1e-6
MATERIAL = 0.003
"""Smallest rms of an effect's torque, over full torque, in the methods that have a threshold; chosen by judgement."""


@functools.lru_cache(maxsize=16)
def _base(toml: str) -> tuple[sm.Drive, Lookup, Array, Array]:
    """Drive, lookup, twists, and the relative change of the torque there for a modulus of gear and cage that is ten per
    cent higher.
    """
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore", sm.DoesNotFitWarning)
        path = Path(folder, "drive.toml")
        path.write_text(toml, encoding="utf-8")
        drive = sm.load_drive(path)
        stiffer = {
            part: replace(m, youngs_modulus=1.1 * m.youngs_modulus)
            for part, m in drive.materials.items()
            if part in ("gear", "cage")
        }
        other = replace(drive, materials={**drive.materials, **stiffer})
        twist = np.linspace(0.1, 1.5, 15) * drive.max_twist
        plain, changed = (sm.simulate(d, twist, 100).torque.mean(axis=0) for d in (drive, other))
        return drive, build_lookup(drive), twist, changed / plain - 1


def columns(
    record: Record, drive: sm.Drive, lookup: Lookup, modulus: tuple[Array, Array]
) -> tuple[Array, dict[str, Array]]:
    """Columns of the base (torque, zero of the twist), (n, 2), and of every effect, (n, k)."""
    starts = np.append(record.starts, len(record))
    twist = _smooth(record.twist(drive.ratio), starts)
    torque, slope = lookup.torque(twist), lookup.stiffness(twist)
    step = 0.5 * lookup.clearance.step
    by_clearance = (lookup.torque(twist, step) - lookup.torque(twist, -step)) / (2 * step) * MICROMETRE
    crank, length = record.crank_angle, 0.02 * drive.max_twist
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(crank)))])
    turn, speed = crank * (1 - 1 / drive.ratio), _rate(_smooth(record.output_angle, starts), record.time, starts)
    inside, outside = _slip(twist, starts, length), _slip(_smooth(record.output_angle, starts), starts, length)
    elapsed = record.time - record.time[0]
    per_torque = slope * drive.max_twist / lookup.full_torque
    seconds = (3.0, 10.0, 30.0)
    groups = {
        "clearance": [by_clearance],
        "thermal_clearance": [by_clearance * (record.temperature - 20)],
        "wear": [by_clearance * travel],
        "modulus_error": [torque * np.interp(np.abs(twist), *modulus)],
        "missing_ball": [f(turn) * torque for f in (np.cos, np.sin)],
        "structural_compliance": [per_torque * torque],
        "creep": [per_torque * _lagged(torque, record.time, starts, s) for s in seconds],
        "kinematic_error": [slope * f(k * crank) for k in (1, 2, 3, 4) for f in (np.cos, np.sin)],
        "hysteresis": [inside],
        "load_dependent_hysteresis": [inside * np.abs(torque)],
        "damping": [_rate(twist, record.time, starts)],
        "coulomb_friction": [outside],
        "viscous_friction": [speed],
        "stribeck_friction": [outside * np.exp(-np.abs(speed) / s) for s in (0.05, 0.2)],
        "torque_sensor_offset": [np.ones_like(torque)],
        "torque_sensor_drift": [elapsed],
    }
    made = {name: np.stack(group, -1) for name, group in groups.items()}
    return np.stack([torque, slope], -1), {
        name: c for name, c in made.items() if np.ptp(c, axis=0).max() > 0 or name == "torque_sensor_offset"
    }


def greedy_bic(
    base: Array, groups: dict[str, Array], y: Array, threshold: float, helped: bool = False
) -> dict[str, Array]:
    """Add the group that lowers n log(RSS/n) + k log n most, until none does.

    helped: n counts independent samples, by the correlation of neighbouring residuals, and a group that contributes
    less than `threshold`, N.m rms, is not added.
    """
    chosen: list[str] = []
    independent = 1.0
    while len(chosen) < len(groups):
        design = {
            name: np.hstack([base, *(groups[c] for c in (*chosen, name))]) for name in groups if name not in chosen
        }
        scores = {name: _bic(d, y, independent) for name, d in design.items()}
        name = min(scores, key=lambda n: scores[n])
        if helped:
            rest = _residual(design[name], y)
            correlation = float(np.clip(rest[1:] @ rest[:-1] / (rest @ rest), 0, 0.999))
            independent = (1 - correlation) / (1 + correlation)
        before = np.hstack([base, *(groups[c] for c in chosen)])
        gained = np.sum(_residual(before, y) ** 2) - np.sum(_residual(design[name], y) ** 2)
        if _bic(design[name], y, independent) >= _bic(before, y, independent):
            break
        if helped and gained / len(y) < threshold**2:
            break
        chosen.append(name)
    return _coefficients(base, groups, y, chosen)


def stlsq(base: Array, groups: dict[str, Array], y: Array, threshold: float) -> dict[str, Array]:
    """Sequentially thresholded least squares on columns of unit rms; threshold: N.m."""
    names = [name for name, c in groups.items() for _ in range(c.shape[1])]
    columns, target = _project_out(base, groups, y)
    active = np.ones(len(names), bool)
    for _ in range(20):
        found, part = np.zeros(len(names)), columns[:, active]
        found[active] = np.linalg.solve(part.T @ part + 1e-3 * len(y) * np.eye(active.sum()), part.T @ target)
        kept = np.abs(found) >= threshold
        if (kept == active).all():
            break
        active = kept
    return _coefficients(base, groups, y, sorted({n for n, k in zip(names, active, strict=True) if k}))


def pysindy(base: Array, groups: dict[str, Array], y: Array, threshold: float) -> dict[str, Array]:
    """pysindy's ensemble of STLSQ fits on resampled rows; names that more than 60 % of the fits keep."""
    from pysindy.optimizers import STLSQ, EnsembleOptimizer

    names = [name for name, c in groups.items() for _ in range(c.shape[1])]
    columns, target = _project_out(base, groups, y)
    single = STLSQ(threshold=threshold, alpha=1e-3 * len(y))
    optimizer = EnsembleOptimizer(single, bagging=True, n_models=20, n_subset=len(y) // 2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimizer.fit(columns, target[:, None])
    kept = np.mean(np.array([c[0] for c in optimizer.coef_list]) != 0, axis=0) > 0.6
    return _coefficients(base, groups, y, sorted({n for n, k in zip(names, kept, strict=True) if k}))


METHODS: dict[str, Callable[[Array, dict[str, Array], Array, float], dict[str, Array]]] = {
    "bic": greedy_bic,
    "bic_helped": partial(greedy_bic, helped=True),
    "stlsq": stlsq,
    "pysindy": pysindy,
}


def reason_to_skip(method: str) -> str:
    """The reason why a method cannot run, or an empty text."""
    return "pysindy is not installed" if method == "pysindy" and importlib.util.find_spec("pysindy") is None else ""


def diagnose(method: str, record_path: Path, drawing_path: Path) -> dict[str, Any]:
    """Verdict and names that a method finds in a record."""
    record = read_record(record_path)
    drive, lookup, *modulus = _base(drawing_path.read_text("utf-8"))
    base, groups = columns(record, drive, lookup, (modulus[0], modulus[1]))
    found = METHODS[method](base, groups, record.output_torque, MATERIAL * lookup.full_torque)
    names = {("backlash" if c[0] > 0 else "preload") if name == "clearance" else name for name, c in found.items()}
    return {
        "schema": 1,
        "verdict": "named" if names else "none",
        "alternatives": [],
        "effects": [{"name": name, "parameters": {}} for name in sorted(names)],
    }


def _coefficients(base: Array, groups: dict[str, Array], y: Array, chosen: list[str]) -> dict[str, Array]:
    all_columns = np.hstack([base, *(groups[name] for name in chosen)])
    scale = _rms(all_columns)
    values = (np.linalg.lstsq(all_columns / scale, y, rcond=None)[0] / scale)[base.shape[1] :]
    ends = np.cumsum([groups[name].shape[1] for name in chosen])
    return {name: values[end - groups[name].shape[1] : end] for name, end in zip(chosen, ends, strict=True)}


def _project_out(base: Array, groups: dict[str, Array], y: Array) -> tuple[Array, Array]:
    """Columns of unit rms and y, both without their projection onto the base."""
    together = np.hstack([*groups.values(), y[:, None]])
    rest = _residual(base, together)
    return rest[:, :-1] / _rms(rest)[:-1], rest[:, -1]


def _residual(design: Array, y: Array) -> Array:
    """Residual of y after a least-squares fit of the design's columns."""
    scaled = design / _rms(design)
    gram = scaled.T @ scaled + 1e-10 * len(y) * np.eye(design.shape[1])
    return y - scaled @ np.linalg.solve(gram, scaled.T @ y)


def _bic(design: Array, y: Array, independent: float) -> float:
    n = len(y) * independent
    return n * float(np.log(np.mean(_residual(design, y) ** 2))) + design.shape[1] * float(np.log(n))


def _rms(values: Array) -> Array:
    return np.maximum(np.sqrt(np.mean(values**2, axis=0)), 1e-300)


def _by_run(starts: NDArray[np.intp]) -> list[slice]:
    return [slice(a, b) for a, b in itertools.pairwise(starts.tolist())]


def _smooth(values: Array, starts: NDArray[np.intp]) -> Array:
    """Mean of three neighbours within a run."""
    out = values.copy()
    for run in _by_run(starts):
        out[run][1:-1] = (values[run][:-2] + values[run][1:-1] + values[run][2:]) / 3
    return out


def _rate(values: Array, time: Array, starts: NDArray[np.intp]) -> Array:
    out = np.zeros_like(values)
    for run in _by_run(starts):
        step = np.maximum(np.gradient(time[run]), 1e-9)
        out[run] = np.gradient(values[run]) / step
    return out


def _slip(path: Array, starts: NDArray[np.intp], length: float) -> Array:
    """State of one slip element along a path, -1 to 1; length: of its presliding."""
    out = np.zeros_like(path)
    for run in _by_run(starts):
        state = 0.0
        steps = np.diff(path[run], prepend=path[run][:1]) / length
        for k, step in enumerate(steps.tolist()):
            state = min(max(state + step, -1.0), 1.0)
            out[run.start + k] = state
    return out


def _lagged(torque: Array, time: Array, starts: NDArray[np.intp], delay: float) -> Array:
    out = np.zeros_like(torque)
    for run in _by_run(starts):
        share = 1 - np.exp(-np.diff(time[run], prepend=time[run][:1]) / delay)
        state = 0.0
        for k, (value, part) in enumerate(zip(torque[run].tolist(), share.tolist(), strict=True)):
            state += part * (value - state)
            out[run.start + k] = state
    return out
