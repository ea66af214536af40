"""The motion pieces of which a protocol is composed: each is one run that a rig performs without interruption.

The library holds loops of several amplitudes at several crank angles, loops at several rates, holds, rotation both ways
under load, many turns, unloaded readings, and loops at other temperatures. Pieces that a rig cannot perform are kept
with the capabilities that they need, so that a plan can state what a better rig would show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import REFERENCE_TEMPERATURE

from .rig import Rig

N_ANGLES = 6
"""Crank angles over a turn at which loops are offered. Chosen by judgement: the orders 1 and 2 of the crank and their
phases need five."""
LOOP_PERIOD, LOOP_SAMPLES, LOOP_CYCLES = 20.0, 60, 2
"""Period, s, samples of a cycle and cycles of a quasi-static loop. Chosen by judgement; two equal cycles are the least
from which the diagnosis estimates the noise."""
DWELLS = (30.0, 120.0)
"""Durations of holds under load, s. Chosen by judgement for relaxation times from some seconds to a minute."""
CRANK_SPEEDS = (0.5, 5.0, 50.0)
"""Speeds of rotation under load, rad/s at the crank: three, a decade apart, as the friction effects require."""
MANY_TURNS = (120.0, 480.0)
"""Durations of rotation between two loops, s. Chosen by judgement; wear is in proportion to the turns."""
SETTING_TIME = 3.0
"""s between two runs, in which the rig moves to the next start. Chosen by judgement."""
STAGES = ("cold", "rates", "holds", "rotation", "turns", "closing", "warm")
"""Order in which the pieces of a protocol are run: what changes the drive (turns, heat) comes late, and repeated loops
after it, so that drift and wear show."""


@dataclass(frozen=True)
class Piece:
    """One run of a protocol, arrays (n,).

    label: what it does, in words; stage: one of `STAGES`; step: s, time since the sample before; crank: rad; twist:
    rad, set point; temperature: degC, constant; needs: capabilities that the rig lacks, empty for a piece that it can
    perform: "angles", "turning", "speed", "temperature", "torque".
    """

    label: str
    stage: str
    step: Array
    crank: Array
    twist: Array
    temperature: float
    needs: frozenset[str] = frozenset()

    def __len__(self) -> int:
        return len(self.step)

    @property
    def seconds(self) -> float:
        """Duration of the run, s."""
        return float(self.step.sum())

    @property
    def travel(self) -> float:
        """Path of the crank, rad."""
        return float(np.abs(np.diff(self.crank)).sum())


def motion_library(rig: Rig, top_twist: float, full_twist: float) -> list[Piece]:
    """All pieces, in the order of `STAGES`.

    top_twist, full_twist: rad, at the rig's greatest torque and at the drive's full torque.
    """
    home = 0.3
    angles = home + 2 * np.pi * np.arange(N_ANGLES) / N_ANGLES
    at_angle = frozenset[str]() if rig.can_set_angles else frozenset({"angles"})
    pieces = [_reading(home, rig)]
    for k, angle in enumerate(angles.tolist()):
        needs = at_angle if k else frozenset[str]()
        pieces += [_loops(angle, share, top_twist, rig, needs) for share in (1.0, 0.5, 0.2)]
        if top_twist < 0.98 * full_twist:
            pieces.append(_loops(angle, 1.0, full_twist, rig, needs | {"torque"}))
    periods = [60.0, math.sqrt(60 * rig.shortest_loop), rig.shortest_loop]
    pieces += [_loops(home, 0.8, top_twist, rig, stage="rates", period=period) for period in periods]
    pieces += [_hold(home, sign * 0.8 * top_twist, dwell, rig) for dwell in DWELLS for sign in (1, -1)]
    for speed in CRANK_SPEEDS:
        for share in (0.5, -0.5) if speed > CRANK_SPEEDS[0] else (0.5, -0.5, 0.9, 0.0):
            pieces.append(_rotation(home, share, top_twist, speed, rig))
    pieces += [_many_turns(home, top_twist, seconds, rig) for seconds in MANY_TURNS]
    warm = REFERENCE_TEMPERATURE + 25.0 if not rig.can_heat else rig.highest
    needs = frozenset[str]() if rig.can_heat else frozenset({"temperature"})
    middle = (REFERENCE_TEMPERATURE + warm) / 2
    pieces += [_loops(home, 1.0, top_twist, rig, needs, "warm", temperature=t) for t in (middle, warm)]
    pieces.append(_loops(float(angles[2]), 1.0, top_twist, rig, needs | at_angle, "warm", temperature=warm))
    return pieces


def feasible(pieces: Sequence[Piece], allowed: frozenset[str] = frozenset()) -> list[int]:
    """Indices of the pieces that the rig can perform, with the additional capabilities `allowed`."""
    return [k for k, piece in enumerate(pieces) if piece.needs <= allowed]


def _count(seconds: float, wanted: int, rig: Rig) -> int:
    """Samples over a duration: `wanted`, or fewer where the rig's sampling rate does not allow them."""
    return max(4, min(wanted, int(seconds * rig.sample_rate)))


def _temperature_text(temperature: float) -> str:
    return "" if temperature == REFERENCE_TEMPERATURE else f" at {temperature:.0f} degC"


def _loops(
    crank: float,
    share: float,
    twist: float,
    rig: Rig,
    needs: frozenset[str] = frozenset(),
    stage: str = "cold",
    period: float = LOOP_PERIOD,
    temperature: float = REFERENCE_TEMPERATURE,
) -> Piece:
    """Triangular loops about zero twist with the crank locked."""
    samples = _count(period, LOOP_SAMPLES, rig)
    phase = np.arange(1, LOOP_CYCLES * samples + 1) / samples
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
    path = share * twist * triangle
    rate = f", {period:.3g} s a loop" if stage == "rates" else ""
    label = f"loops to {100 * share:.0f} % of {'the greatest' if 'torque' not in needs else 'full'} twist at crank "
    label += f"{math.degrees(crank) % 360:.0f} deg{rate}{_temperature_text(temperature)}"
    return Piece(
        label, stage, np.full(len(path), period / samples), np.full(len(path), crank), path, temperature, needs
    )


def _ramp(start: float, end: float, seconds: float, samples: int) -> tuple[Array, Array]:
    part = np.arange(1, samples + 1) / samples
    return np.full(samples, seconds / samples), start + (end - start) * part


def _hold(crank: float, twist: float, dwell: float, rig: Rig) -> Piece:
    """A hold under load, unloading, and a hold without load of half that time."""
    parts = [
        _ramp(0.0, twist, 4.0, _count(4.0, 20, rig)),
        _ramp(twist, twist, dwell, 90),
        _ramp(twist, 0.0, 4.0, _count(4.0, 20, rig)),
        _ramp(0.0, 0.0, dwell / 2, 50),
    ]
    step, path = (np.concatenate([part[k] for part in parts]) for k in range(2))
    label = f"hold for {dwell:.0f} s under {'positive' if twist > 0 else 'negative'} torque, then unloaded"
    return Piece(label, "holds", step, np.full(len(path), crank), path, REFERENCE_TEMPERATURE)


def _reading(crank: float, rig: Rig) -> Piece:
    """The unloaded drive."""
    step, path = _ramp(0.0, 0.0, 10.0, _count(10.0, 50, rig))
    return Piece("unloaded reading", "cold", step, np.full(len(path), crank), path, REFERENCE_TEMPERATURE)


def _turn(start: float, turns: float, seconds: float, samples: int) -> tuple[Array, Array]:
    """Steps, s, and crank angles, rad, of a rotation with a smooth start and stop over a tenth of the time each."""
    s = np.arange(1, samples + 1) / samples
    way = np.where(s < 0.1, s**2 / 0.2, np.where(s > 0.9, 0.9 - (1 - s) ** 2 / 0.2, s - 0.05)) / 0.9
    return np.full(samples, seconds / samples), start + turns * 2 * np.pi * way


def _rotation(crank: float, share: float, top_twist: float, speed: float, rig: Rig) -> Piece:
    """Rotation there and back at a constant share of the greatest twist."""
    turns = max(2.0, speed / (2 * np.pi))
    seconds = turns * 2 * np.pi / speed / 0.9
    samples = _count(seconds, 140, rig)
    ramp_step, ramp = _ramp(0.0, share * top_twist, 4.0, _count(4.0, 20, rig))
    step, there = _turn(crank, turns, seconds, samples)
    back = _turn(float(there[-1]), -turns, seconds, samples)[1]
    return Piece(
        f"{turns:.0f} turns of the crank there and back at {speed:g} rad/s under {100 * share:.0f} % of the twist",
        "rotation",
        np.concatenate([ramp_step, step, step]),
        np.concatenate([np.full(len(ramp), crank), there, back]),
        np.concatenate([ramp, np.full(2 * samples, share * top_twist)]),
        REFERENCE_TEMPERATURE,
        _rotation_needs(speed, rig),
    )


def _rotation_needs(speed: float, rig: Rig) -> frozenset[str]:
    if not rig.can_turn:
        return frozenset({"turning"})
    return frozenset({"speed"} if speed > rig.speed else ())


def _many_turns(crank: float, top_twist: float, seconds: float, rig: Rig) -> Piece:
    """Many turns at the rig's greatest speed under a small load, then loops."""
    speed = rig.speed if rig.can_turn else Rig().speed
    # Whole turns, so that the loops are at the crank angle of those before.
    turns = max(1.0, round(0.9 * seconds * speed / (2 * np.pi)))
    up = _ramp(0.0, 0.3 * top_twist, 4.0, _count(4.0, 20, rig))
    step, way = _turn(crank, turns, turns * 2 * np.pi / speed / 0.9, 40)
    loops = _loops(float(way[-1]), 1.0, top_twist, rig)
    down = _ramp(0.3 * top_twist, 0.0, 4.0, _count(4.0, 20, rig))
    return Piece(
        f"{turns:.0f} turns of the crank at {speed:g} rad/s, then loops to the greatest twist",
        "turns",
        np.concatenate([up[0], step, down[0], loops.step]),
        np.concatenate([np.full(len(up[0]), crank), way, np.full(len(down[0]), way[-1]), loops.crank]),
        np.concatenate([up[1], np.full(len(way), 0.3 * top_twist), down[1], loops.twist]),
        REFERENCE_TEMPERATURE,
        _rotation_needs(0.0, rig),
    )
