"""One blind case: from its specification to a record, its drawing and the truth, which is kept separately."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from .drawings import DRAWINGS
from .elements import Array, draw_individual
from .outside import KINDS
from .plant import Behaviour, Motion, run
from .protocols import PROTOCOLS, Schedule
from .sensors import Reading, Sensors, read
from .sizing import find_size, rms, scatter_along, setter, shapes
from .tables import tables

ARCMIN = np.pi / 180 / 60
LARGEST = 0.15
"""Greatest contribution of an effect to the torque, rms over full torque; chosen by judgement."""


@dataclass(frozen=True)
class Case:
    """Specification of a record. effects: names (of effects or of `outside.KINDS`) and sizes in standard deviations of
    the noise; drawing: index of `DRAWINGS`; individual: whether deviations are drawn; base: errors of the curve within
    the tolerances, over the population's spread; places: deviation of the places of an individual's bores and lobes
    over that of the lobes' sizes; missing: columns left out ("temperature"; "crank_angle", which gives a twist column;
    "run").
    """

    number: int
    category: str
    effects: tuple[tuple[str, float], ...] = ()
    drawing: int = 0
    protocol: str = "full"
    sensors: Sensors = field(default_factory=Sensors)
    individual: bool = False
    base: tuple[float, float] = (0.0, 0.0)
    places: float = 0.0
    missing: tuple[str, ...] = ()
    seed: int = 0


@dataclass(frozen=True)
class Truth:
    """The hidden truth of a record. sigmas: rms of each effect's contribution to the torque over that of the noise;
    scatter_sigmas: the same over the part of the scatter of individuals that resembles it; parameters: of the named
    effects, SI; noise, full_torque: N.m.
    """

    case: Case
    effects: tuple[str, ...]
    outside: tuple[str, ...]
    sigmas: Mapping[str, float]
    scatter_sigmas: Mapping[str, float]
    parameters: Mapping[str, Mapping[str, float]]
    noise: float
    full_torque: float

    @property
    def separable(self) -> bool:
        """Whether the protocol distinguishes the effects from all others: the full one does, except for modulus and
        series spring on a plastic drive, and for the two together.
        """
        alike = {"modulus_error", "structural_compliance"} & set(self.effects)
        told = len(alike) == 0 or (len(alike) == 1 and not DRAWINGS[self.case.drawing].plastic)
        return self.case.protocol == "full" and told

    def to_json(self) -> str:
        return json.dumps(asdict(self))


@dataclass(frozen=True)
class Sealed:
    """A simulated case: the table that is written, and the truth. motion, test, reading: for tests of the generator."""

    truth: Truth
    table: Mapping[str, Array]
    test: Schedule
    motion: Motion
    reading: Reading

    def write(self, folder: Path) -> tuple[Path, Path]:
        """Write record and drawing; their names do not reveal the content."""
        folder.mkdir(parents=True, exist_ok=True)
        record, drawing = folder / f"record_{self.truth.case.number:04d}.csv", folder / "drive.toml"
        drawing.write_text(DRAWINGS[self.truth.case.drawing].toml, encoding="utf-8")
        formats = ["%d" if title == "run" else "%.10g" for title in self.table]
        np.savetxt(
            record,
            np.stack(list(self.table.values()), -1),
            formats,
            ",",
            header=",".join(self.table),
            comments="",
            encoding="utf-8",
        )
        return record, drawing


def make(case: Case) -> Sealed:
    """Simulate and measure a case. The same case gives the same record."""
    table = tables(case.drawing)
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(case.seed, spawn_key=(case.number,)).spawn(5)]
    test = PROTOCOLS[case.protocol](streams[0], DRAWINGS[case.drawing].ratio)
    behaviour = shapes(table, streams[1])
    one = draw_individual(table.drive, streams[2], case.places) if case.individual else None
    plain = run(table, behaviour, test)
    full, noise = table.full_torque, case.sensors.noise
    sigmas: dict[str, float] = {}
    over_scatter: dict[str, float] = {}
    start, traces = behaviour, {}
    # The missing ball comes first: its size is fixed, so that the noise follows from the ratio that is wanted.
    for name, wanted in sorted(case.effects, key=lambda e: e[0] != "missing_ball"):
        put = setter(name, streams[3])
        size, trace = find_size(name, put, start, table, plain, test, min(wanted * noise, LARGEST) * full)
        if name == "missing_ball" and wanted > 0:
            noise = float(np.clip(rms(trace) / wanted / full, 3e-4, 0.02))
        share = scatter_along(table, test, plain, trace) if rms(trace) else float("inf")
        if one is not None and 1 < share * wanted < np.inf and name != "missing_ball":
            # On an individual the size is relative to noise or scatter, whichever is greater.
            size, trace = find_size(
                name, put, start, table, plain, test, min(share * wanted * rms(trace), LARGEST * full)
            )
            share = scatter_along(table, test, plain, trace)
        over_scatter[name] = 1 / share
        behaviour, traces[name] = put(behaviour, size), trace
    motion = run(table, replace(behaviour, base=case.base), test, one)
    reading = read(table, test, motion, replace(case.sensors, noise=noise), streams[4])
    noise_rms = rms(reading.noise)
    sigmas = {name: rms(trace) / noise_rms if noise_rms else np.inf for name, trace in traces.items()}
    names = [name for name, _ in case.effects]
    truth = Truth(
        case,
        tuple(sorted(n for n in names if n not in KINDS)),
        tuple(n for n in names if n in KINDS),
        sigmas,
        over_scatter,
        {n: parameters(n, behaviour, test) for n in names if n not in KINDS},
        noise_rms,
        full,
    )
    return Sealed(truth, _columns(reading, test, case, table.drive.ratio), test, motion, reading)


def parameters(name: str, b: Behaviour, test: Schedule) -> dict[str, float]:
    """Parameters of an effect, SI, that can be compared with those of another constitutive law."""
    seconds = test.time[-1] - test.time[0]
    orders = {f"amplitude_{k}": b.kinematic * w for k, w, _ in b.orders}
    return {
        "backlash": {"clearance": b.clearance},
        "preload": {"clearance": -b.clearance},
        "thermal_clearance": {"rate": b.thermal},
        "wear": {"rate": b.wear},
        "modulus_error": {"error": b.modulus - 1},
        "structural_compliance": {"compliance": b.compliance},
        "creep": {"compliance": b.creep},
        "kinematic_error": orders,
        "hysteresis": {"torque": b.hysteresis},
        "load_dependent_hysteresis": {"fraction": b.load_hysteresis},
        "damping": {"coefficient": b.damping},
        "coulomb_friction": {"torque": b.coulomb},
        "viscous_friction": {"coefficient": b.viscous},
        "stribeck_friction": {"torque": b.stribeck},
        "torque_sensor_offset": {"torque": b.offset},
        "torque_sensor_drift": {"rate": float(b.drift / seconds)},
        "missing_ball": {},
    }[name]


def _columns(reading: Reading, test: Schedule, case: Case, ratio: float) -> dict[str, Array]:
    table = {"time [s]": reading.time, "run": test.run}
    if "crank_angle" in case.missing:
        table["twist [arcmin]"] = (reading.crank / ratio - reading.output) / ARCMIN
    else:
        table |= {"crank_angle [rad]": reading.crank, "output_angle [rad]": reading.output}
    table |= {"output_torque [N.m]": reading.torque, "temperature [degC]": reading.temperature}
    return {title: values for title, values in table.items() if title.split(" ")[0] not in case.missing}
