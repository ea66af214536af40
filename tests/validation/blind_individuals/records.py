"""One sealed case: from its specification to a record, and the truth, which is kept apart."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from stiffness_model import DoesNotFitWarning
from stiffness_model.numerics.arrays import Array
from tests.validation.blind.drawings import DRAWINGS, load
from tests.validation.blind.protocols import PROTOCOLS, Schedule

from .bounds import SEPARABLE, Responses, Sight, sight
from .catalogue import Case
from .contacts import Assembly, MeanDrive, draw_assembly, mean_drive, varied
from .measure import csv_text, measured
from .priors import (
    BASE_SOFT_PLASTIC,
    BASE_SOFT_STEEL,
    TOLERATED,
    base_factors,
    draw_foreign,
    draw_shape,
    draw_size,
    mean_of,
    tolerance_deviation,
)
from .simulate import Hidden, Motion, run


@dataclass(frozen=True)
class Truth:
    """The label. parameters: of the hidden effects, SI, by the diagnosis' names; deviations: one `tolerance_deviation`
    of each effect that has one; noise: rms, N.m; base_off: whether gear's and cage's modulus is off within tolerance.
    """

    case: Case
    parameters: Mapping[str, Mapping[str, float]]
    deviations: Mapping[str, float]
    sight: Sight
    noise: float
    full_torque: float
    samples: int
    base_off: bool

    @property
    def separable(self) -> bool:
        """Whether every hidden effect can be told from every other name, by the Cramer-Rao bound."""
        return bool(self.sight.isolable) and min(self.sight.isolable.values()) >= SEPARABLE

    def to_dict(self) -> dict[str, Any]:
        """For a row of results. What has no name is told by its being there: its kind stays in the catalogue."""
        case = self.case
        return {
            "seed": case.seed,
            "number": case.number,
            "category": case.category,
            "names": list(case.names),
            "foreign": case.foreign is not None,
            "protocol": case.protocol,
            "individual": case.individual,
            "missing": list(case.missing),
            "drawing": case.drawing,
            "correlation": case.rig.correlation,
            "parameters": {name: dict(values) for name, values in self.parameters.items()},
            "deviations": dict(self.deviations),
            "separable": self.separable,
            "base_off": self.base_off,
            "noise": self.noise,
            "full_torque": self.full_torque,
            "samples": self.samples,
            **{key: value for key, value in asdict(self.sight).items() if key != "foreign"},
            "foreign_seen": self.sight.foreign,
        }


@dataclass(frozen=True)
class Sealed:
    """A made case: the record's columns, the truth; motion, test, noise: for tests of the generator."""

    truth: Truth
    table: Mapping[str, Array]
    motion: Motion
    test: Schedule
    noise: Array

    @property
    def record(self) -> str:
        """Text of the record's file."""
        return csv_text(self.table)

    @property
    def drawing(self) -> str:
        """Text of the drawing's file: as drawn, whatever the drive became."""
        return DRAWINGS[self.truth.case.drawing].toml


def make(case: Case, bounds: bool = True) -> Sealed:
    """Simulate and measure a case; the same case gives the same record. bounds: whether to compute what can be told."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoesNotFitWarning)
        return _made(case, bounds)


def _made(case: Case, bounds: bool) -> Sealed:
    drawn, mean = load(case.drawing), mean_of(case.drawing)
    test = PROTOCOLS[case.protocol](case.stream(0), drawn.transmission_ratio)
    hidden = draw_hidden(case)
    drive = _drive(case, hidden, mean)
    motion = run(mean, hidden, test, drive)
    table, noise = measured(case, mean, test, motion, case.stream(4))
    found = Sight({}, {}, {}, {}, 0.0)
    if bounds:
        named = replace(hidden, foreign=None)
        both = None if hidden.foreign is None else (motion, run(mean, named, test, drive))
        start = drive.one.start if isinstance(drive, Assembly) else 0.0
        found = sight(case, hidden, Responses(case, mean, test), both, start, case.stream(6))
    deviations = {name: tolerance_deviation(name, case.drawing) for name in TOLERATED}
    truth = Truth(
        case,
        {name: parameters(name, hidden) for name in case.names},
        {name: value for name, value in deviations.items() if value is not None},
        found,
        float(np.sqrt(np.mean(noise**2))),
        mean.full_torque,
        len(test.time),
        case.category == "base",
    )
    return Sealed(truth, table, motion, test, noise)


def draw_hidden(case: Case) -> Hidden:
    """Sizes and forms of what is hidden in a case."""
    rng = case.stream(2)
    sizes = {name: draw_size(name, case.drawing, rng) for name in case.names}
    if case.category == "tiny":
        name = case.names[0]
        deviation = tolerance_deviation(name, case.drawing)
        assert deviation is not None
        sizes[name] = float(np.sign(sizes[name]) * deviation * np.exp(rng.uniform(np.log(0.01), np.log(0.09))))
    foreign = None if case.foreign is None else draw_foreign(case.foreign, rng)
    return Hidden(sizes, draw_shape(case.drawing, case.stream(1)), foreign)


def _drive(case: Case, hidden: Hidden, mean: MeanDrive) -> MeanDrive | Assembly | None:
    """The drive that is measured; None for the mean drive as drawn."""
    drawn, rng = load(case.drawing), case.stream(3)
    factor = 1 + hidden["modulus_error"]
    if not case.individual:
        return None if factor == 1 else mean_drive(varied(drawn, soft=factor))
    plastic = DRAWINGS[case.drawing].plastic
    soft = (BASE_SOFT_PLASTIC if plastic else BASE_SOFT_STEEL) if case.category == "base" else 0.0
    eccentricity, hard, tolerated = base_factors(drawn, case.stream(5), soft)
    assembly = draw_assembly(varied(drawn, eccentricity, hard, tolerated * factor), rng)
    if not hidden["missing_ball"]:
        return assembly
    start = assembly.one.start + 2 * np.pi * np.arange(drawn.elements) / drawn.elements
    away = np.abs(np.mod(start - hidden.shape.place + np.pi, 2 * np.pi) - np.pi)
    return replace(assembly, missing=int(np.argmin(away)))


def parameters(name: str, hidden: Hidden) -> dict[str, float]:
    """Sizes of an effect that mean the same in a diagnosis of another form, SI."""
    size = hidden[name]
    key = {
        "backlash": "clearance",
        "preload": "clearance",
        "thermal_clearance": "rate",
        "wear": "rate",
        "modulus_error": "error",
        "structural_compliance": "compliance",
        "hysteresis": "torque",
        "load_dependent_hysteresis": "fraction",
        "damping": "coefficient",
        "coulomb_friction": "torque",
        "viscous_friction": "coefficient",
        "torque_sensor_offset": "torque",
    }.get(name)
    if name == "kinematic_error":
        return {f"amplitude_{k}": size * weight for k, weight, _ in hidden.shape.orders}
    return {} if key is None else {key: size}
