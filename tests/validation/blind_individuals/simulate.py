"""The simulated test: a drive with its hidden effects on the rig, as a perfect measurement would see it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from stiffness_model.numerics.arrays import Array
from tests.validation.blind.forms import rate, retarded
from tests.validation.blind.protocols import Schedule

from .contacts import Assembly, MeanDrive
from .foreign import Foreign, Scene, added

REFERENCE = 20.0
"""degC, at which the clearance is the drawn one."""


@dataclass(frozen=True)
class Shape:
    """The constitutive forms that the hidden effects have in one case.

    slip: slip lengths, rad, of the parallel elements of dry friction inside the drive; rubbing: likewise at the output;
    creep_times, creep_weights: retardation spectrum, s; bearing: exponent of the part of the series spring that
    stiffens, and its share; orders: (order, weight, phase) of the kinematic error; stribeck: turn-over speed, rad/s,
    and exponent; settling: of the sensor's drift, over the record's length; place: of the missing ball, rad.
    """

    slip: tuple[float, ...] = (1e-4,)
    rubbing: tuple[float, ...] = (1e-4,)
    creep_times: tuple[float, ...] = (10.0,)
    creep_weights: tuple[float, ...] = (1.0,)
    bearing: tuple[float, float] = (1.0, 0.0)
    orders: tuple[tuple[int, float, float], ...] = ((1, 1.0, 0.0),)
    stribeck: tuple[float, float] = (0.1, 2.0)
    settling: float = 2.0
    place: float = 0.0


@dataclass(frozen=True)
class Hidden:
    """Sizes of the named effects, SI, signs as the contract has them (a preload's clearance is positive); the modulus
    error is relative; the missing ball's size is 1. foreign: what has no name, if anything."""

    sizes: Mapping[str, float] = field(default_factory=dict)
    shape: Shape = Shape()
    foreign: Foreign | None = None

    def __getitem__(self, name: str) -> float:
        return self.sizes.get(name, 0.0)


@dataclass(frozen=True)
class Motion:
    """What a perfect rig would see, (n,). crank, output: rad; torque: N.m; twist: rad, with all that gives; contact:
    rad, of the contacts alone; slope: N.m/rad, of the mean drive at the twist; gap: N.m, torque less that of the mean
    drive as drawn."""

    crank: Array
    output: Array
    torque: Array
    twist: Array
    contact: Array
    slope: Array
    gap: Array


def clearances(hidden: Hidden, test: Schedule) -> Array:
    """Gear clearance beyond the drawing's at every sample, m."""
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(test.crank)))])
    constant = hidden["backlash"] - hidden["preload"]
    return constant + hidden["thermal_clearance"] * (test.temperature - REFERENCE) + hidden["wear"] * travel


def run(
    mean: MeanDrive,
    hidden: Hidden,
    test: Schedule,
    drive: MeanDrive | Assembly | None = None,
    contact: Array | None = None,
) -> Motion:
    """Simulate a test of `drive` (None: the mean drive itself). Every run starts relaxed.

    The contacts' twist is where the mean drive would rest under the load, or `contact`, rad, (n,); the torque is the
    drive's own there. A modulus error is in the parts of `drive`; so is an assembly's missing ball.
    """
    contacts = drive or mean
    more = clearances(hidden, test)
    if contact is None:
        contact = mean.twist_under(test.load, more)
    cage = test.crank / mean.drive.ratio - contact
    full = mean.full_torque
    elastic = contacts.torque(contact, cage, more)
    if hidden["missing_ball"] and not isinstance(contacts, Assembly):
        elastic = elastic - mean.missing_torque(contact, cage, more, hidden.shape.place)
    twist = contact + _series(hidden, test, elastic, full)
    kinematic = hidden["kinematic_error"] * sum(w * np.sin(k * test.crank + p) for k, w, p in hidden.shape.orders)
    twist = twist + kinematic
    torque = elastic + _parallel(hidden, test, twist, elastic)
    if hidden.foreign is not None:
        scene = Scene(test, contact, cage, elastic, twist, full, mean.full_twist, mean.slope(contact))
        more_torque, more_twist = added(hidden.foreign, scene)
        twist, torque = twist + more_twist, torque + more_torque
    output = test.crank / mean.drive.ratio - twist
    torque = torque - _friction(hidden, test, output) + _sensor(hidden, test)
    gap = torque - mean.torque(twist, cage, np.zeros(len(twist)))
    return Motion(test.crank, output, torque, twist, contact, mean.slope(twist), gap)


def _series(hidden: Hidden, test: Schedule, elastic: Array, full: float) -> Array:
    """Twist, rad, outside the contacts under the elastic torque."""
    twist = np.zeros(len(elastic))
    if hidden["structural_compliance"]:
        exponent, share = hidden.shape.bearing
        bent = np.sign(elastic) * np.abs(elastic / full) ** exponent * full
        twist += hidden["structural_compliance"] * ((1 - share) * elastic + share * bent)
    if hidden["creep"]:
        for time, weight in zip(hidden.shape.creep_times, hidden.shape.creep_weights, strict=True):
            followed = retarded(elastic, test.time, test.starts, time, from_rest=True)
            twist += hidden["creep"] * weight * followed
    return twist


def slipping(way: Array, starts: Array, lengths: tuple[float, ...]) -> Array:
    """Share of the dry friction, -1 to 1, of parallel elastic elements that slip (Iwan), at rest at every start."""
    step = np.diff(way, prepend=way[0])
    fresh = np.zeros(len(way), bool)
    fresh[starts[:-1]] = True
    out = np.zeros(len(way))
    for length in lengths:
        state = 0.0
        for k, (change, new) in enumerate(zip(step.tolist(), fresh.tolist(), strict=True)):
            state = 0.0 if new else min(max(state + change, -length), length)
            out[k] += state / length
    return out / len(lengths)


def _parallel(hidden: Hidden, test: Schedule, twist: Array, elastic: Array) -> Array:
    torque = np.zeros(len(twist))
    if hidden["hysteresis"] or hidden["load_dependent_hysteresis"]:
        share = slipping(twist, test.starts, hidden.shape.slip)
        torque += (hidden["hysteresis"] + hidden["load_dependent_hysteresis"] * np.abs(elastic)) * share
    if hidden["damping"]:
        torque += hidden["damping"] * rate(twist, test.time, test.starts)
    return torque


def _friction(hidden: Hidden, test: Schedule, output: Array) -> Array:
    torque = np.zeros(len(output))
    if not (hidden["coulomb_friction"] or hidden["viscous_friction"] or hidden["stribeck_friction"]):
        return torque
    speed = rate(output, test.time, test.starts)
    torque += hidden["viscous_friction"] * speed
    turnover, exponent = hidden.shape.stribeck
    falling = 1 / (1 + np.abs(speed / turnover) ** exponent)
    dry = hidden["coulomb_friction"] + hidden["stribeck_friction"] * falling
    return torque + dry * slipping(output, test.starts, hidden.shape.rubbing)


def _sensor(hidden: Hidden, test: Schedule) -> Array:
    seconds = test.time - test.time[0]
    settling = hidden.shape.settling * max(float(seconds[-1]), 1.0)
    grown = settling * (1 - np.exp(-seconds / settling))
    return hidden["torque_sensor_offset"] + hidden["torque_sensor_drift"] * grown
