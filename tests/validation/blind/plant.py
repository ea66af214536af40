"""The simulated drive with its hidden effects on the rig: true angles and torque over a test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import forms
from .contact_law import ContactLaw, individual_law, mean_law, mean_torque_at, rest
from .elements import Array, Individual
from .outside import Outside, outside_series, outside_torque
from .protocols import Schedule
from .tables import Tables

REFERENCE = 20.0
"""Temperature, degC, at which the clearance is that of the drawing."""
ELEMENT_FRICTION = 0.15
"""Share of load-dependent friction that follows the forces of the elements instead of the drive's torque; chosen by
judgement."""


@dataclass(frozen=True)
class Behaviour:
    """Every hidden effect with its size; by default there are none. Signs as in `reefmu.effects`.

    clearance: m (backlash +, preload -); thermal: m/K; wear: m/rad of crank travel; modulus: factor on gear and
    cage; missing: position of the missing ball on the profile at crank angle 0, rad; compliance, creep:
    rad/(N.m); creep_time: s; kinematic: amplitude, rad, of the `orders` with their weights and phases;
    hysteresis: N.m; presliding: rad of twist; load_hysteresis: share of the elastic torque; damping: N.m s/rad;
    coulomb, stribeck: N.m; viscous: N.m s/rad, at the output; rubbing: rad of output; turnover: rad/s; offset:
    N.m; drift: N.m at the end of the record. base: errors of the curve within the tolerances, over the spread of the
    population: scale and curvature.
    """

    clearance: float = 0.0
    thermal: float = 0.0
    wear: float = 0.0
    modulus: float = 1.0
    missing: float | None = None
    compliance: float = 0.0
    creep: float = 0.0
    creep_time: float = 10.0
    kinematic: float = 0.0
    orders: tuple[tuple[int, float, float], ...] = ((1, 1.0, 0.0),)
    hysteresis: float = 0.0
    presliding: float = 1e-4
    load_hysteresis: float = 0.0
    damping: float = 0.0
    coulomb: float = 0.0
    viscous: float = 0.0
    stribeck: float = 0.0
    rubbing: float = 1e-4
    turnover: float = 0.1
    offset: float = 0.0
    drift: float = 0.0
    base: tuple[float, float] = (0.0, 0.0)
    outside: Outside | None = None


@dataclass(frozen=True)
class Motion:
    """What a rig without errors would measure, arrays (n,). crank, output: rad; torque: N.m; twist: rad, without the
    arbitrary zero of the rig; model: torque, N.m, of the drawing's mean drive at that twist; stiffness: its slope,
    N.m/rad.
    """

    crank: Array
    output: Array
    torque: Array
    twist: Array
    model: Array
    stiffness: Array

    @property
    def gap(self) -> Array:
        """Torque that the model lacks, N.m."""
        return self.torque - self.model


def clearances(behaviour: Behaviour, test: Schedule) -> Array:
    """Additional gear clearance at every sample, m."""
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(test.crank)))])
    return behaviour.clearance + behaviour.thermal * (test.temperature - REFERENCE) + behaviour.wear * travel


def law_of(tables: Tables, behaviour: Behaviour, test: Schedule, one: Individual | None) -> ContactLaw:
    """The contacts of the mean drive, or of the individual `one`."""
    if one is None:
        return mean_law(tables, behaviour.modulus, behaviour.missing)
    return individual_law(tables, one, test.crank, clearances(behaviour, test), behaviour.modulus, behaviour.missing)


def run(tables: Tables, behaviour: Behaviour, test: Schedule, one: Individual | None = None) -> Motion:
    """Simulate a test. Every run starts with all states at zero."""
    law, b, full, starts = law_of(tables, behaviour, test, one), behaviour, tables.full_torque, test.starts
    rows = law.rows(clearances(b, test), test.crank)
    if b.base != (0.0, 0.0):
        bend = np.abs(rows) / full - 0.5
        rows = rows * (1 + tables.spread * (b.base[0] + b.base[1] * bend))
    inner, elastic = rest(tables, rows, test.load)
    elastic = outside_torque(b.outside, elastic, test, full)
    followed = forms.prony(elastic, test.time, starts, b.creep_time) if b.creep else np.zeros(len(elastic))
    twist = inner + b.compliance * forms.bearing_spring(elastic, full) + b.creep * followed
    twist = twist + outside_series(b.outside, elastic, full)
    kinematic = b.kinematic * sum(w * np.sin(k * test.crank + phase) for k, w, phase in b.orders)
    output = test.crank / tables.drive.ratio - twist - kinematic
    torque = elastic + _parallel(tables, b, test, twist, inner, elastic) - _friction(b, test, output)
    torque = torque + b.offset + b.drift * _drifted(test)
    measured = twist + kinematic
    step = 1e-3 * tables.full_twist
    model, above, below = (mean_torque_at(tables, measured + d) for d in (0.0, step, -step))
    return Motion(test.crank, output, torque, measured, model, (above - below) / (2 * step))


def _parallel(tables: Tables, b: Behaviour, test: Schedule, twist: Array, inner: Array, elastic: Array) -> Array:
    torque = np.zeros(len(twist))
    if b.hysteresis or b.load_hysteresis:
        share = forms.slip(twist, test.starts, b.presliding)
        pressed = np.interp(np.abs(inner), tables.x, tables.absolute)
        width = (1 - ELEMENT_FRICTION) * np.abs(elastic) + ELEMENT_FRICTION * pressed
        torque += (b.hysteresis + b.load_hysteresis * width) * share
    if b.damping:
        torque += b.damping * forms.rate(twist, test.time, test.starts)
    return torque


def _friction(b: Behaviour, test: Schedule, output: Array) -> Array:
    if not (b.coulomb or b.viscous or b.stribeck):
        return np.zeros(len(output))
    speed = forms.rate(output, test.time, test.starts)
    share = forms.slip(output, test.starts, b.rubbing)
    return (b.coulomb + b.stribeck * forms.stribeck(speed, b.turnover)) * share + b.viscous * speed


def _drifted(test: Schedule) -> Array:
    """Growth of the sensor's drift over the record, from 0 to 1, with decreasing rate."""
    part = (test.time - test.time[0]) / (test.time[-1] - test.time[0])
    return (1 - np.exp(-0.7 * part)) / (1 - np.exp(-0.7))
