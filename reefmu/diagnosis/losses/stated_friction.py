"""The torque at the output from the motor's, less the friction at the crank that the drive states.

The motor's torque is T_m = U + F, with the torque U that the output has at the crank without losses and the friction
F(U, crank's motion) of the effect `crank_friction`, a state that sticks and slides. It is solved for U by iterating

    U <- T_m - F(U, crank's motion),

which converges since friction grows with the load by a fraction below 1. The friction is that of `reefmu.simulate`, so
that a model of the drive that is solved to the motor's side agrees with the record. It grows with the elastic torque,
which is U less the friction inside the drive and at the output. That is known once the record is diagnosed: a second
diagnosis then takes it into account.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stiffness_model.errors import expect
from stiffness_model.lookup.curve_lookup import NOMINAL_LEVER, curve_lookup
from stiffness_model.numerics.arrays import Array

from ...effects import Place
from ...model.drive_model import DriveModel, build_curve_model
from ...record import Record, with_twist_zero
from ...simulate import simulate_record
from ..preprocessing.trace import make_trace
from .crank_losses import CRANK_FRICTION

BESIDE_ELASTIC = (Place.PARALLEL, Place.OUTPUT)
"""Places of the effects whose torque is not elastic."""
TOLERANCE = 1e-6
"""Change of U over its range at which the iteration ends. Chosen by judgement, far below the noise of any sensor."""
MAX_STEPS = 60
"""Iterations at most. A fraction of 0.8, an efficiency of 56 %, takes as many for the tolerance."""


def without_stated_friction(
    record: Record, friction: Mapping[str, float], ratio: float, inside: Array | None = None
) -> Record:
    """A record of the motor's torque whose `output_torque` is without the friction at the crank.

    friction: parameters of `crank_friction` by name; ratio: signed, crank to output. The crank must turn.
    inside: (n,) N.m, friction inside the drive and at the output, see `friction_inside`. What the motor's torque holds
    besides, friction of the motor among it, remains. Raises `InputError` for friction that grows
    as fast as the load, which no torque of the motor shows.
    """
    trace = make_trace(record, ratio)
    speeds = np.stack([trace.crank_speed, trace.output_speed], axis=1)
    motion = replace(record, crank_angle=trace.crank, speeds=speeds)
    stated = record.output_torque
    span = float(np.ptp(stated)) or 1.0
    model, reach = _unit_spring(friction, ratio, 2 * float(np.abs(stated).max()) or 1.0)
    torque, inside = stated, np.zeros(len(record)) if inside is None else inside
    for _ in range(MAX_STEPS):
        # A spring of 1 N.m/rad over its twist: the twist that holds this torque.
        held = replace(motion, output_angle=trace.crank / ratio - np.clip(torque - inside, -reach, reach))
        found = stated - ratio * _friction(model, held, ratio)
        change, torque = float(np.abs(found - torque).max()), found
        if change < TOLERANCE * span:
            return replace(record, output_torque=torque)
    expect(False, "friction at the crank that grows by less than the load", friction.get("fraction"), CRANK_FRICTION)
    raise AssertionError


def friction_inside(model: DriveModel, record: Record) -> Array:
    """Friction (n,), N.m, of a model inside the drive and at the output, along a record."""
    elastic = tuple(effect for effect in model.effects if effect.place not in BESIDE_ELASTIC)
    if elastic == model.effects:
        return np.zeros(len(record))
    names = {effect.name for effect in elastic}
    kept = tuple(p for p in model.parameters if "." not in p.name or p.name.split(".")[0] in names)
    zeroed = with_twist_zero(record, model.twist_zero)
    whole, without = (
        simulate_record(model, zeroed),
        simulate_record(replace(model, effects=elastic, parameters=kept), zeroed),
    )
    return whole["output.tau"] - without["output.tau"]


def _unit_spring(friction: Mapping[str, float], ratio: float, reach: float) -> tuple[DriveModel, float]:
    """A drive of 1 N.m/rad with this friction, up to a twist, rad, and that twist."""
    line = np.array([-reach, 0.0, reach])
    return build_curve_model(curve_lookup(line, line, NOMINAL_LEVER, "load", ratio), {CRANK_FRICTION: friction}), reach


def _friction(model: DriveModel, record: Record, ratio: float) -> Array:
    """Friction (n,), N.m at the crank, along the record of a model; against a positive motion it is positive."""
    response = simulate_record(model, record)
    return -response["crank.tau"] - response["output.tau"] / ratio
