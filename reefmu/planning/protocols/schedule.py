"""A protocol as a schedule of runs in time, and the record that a drive of the population would give along it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array
from stiffness_model.rotation import draw_individual
from stiffness_model.units import REFERENCE_TEMPERATURE

from ...model.drive_model import build_model
from ...record import Record, make_record
from ...simulate import simulate_record
from .motion_pieces import SETTING_TIME, STAGES, Piece
from .rig import Rig

REPEATED_STAGE = STAGES.index("closing")
"""Stage of the second and later copies of a piece, which come after what may change the drive."""


@dataclass(frozen=True)
class Schedule:
    """Runs in their order.

    chosen: indices of the library's pieces; pieces: these pieces; begin: (r,) s, time of the first sample of each run;
    travelled: (r,) rad, path of the crank before each run; seconds: whole duration with the times between the runs.
    """

    chosen: tuple[int, ...]
    pieces: tuple[Piece, ...]
    begin: Array
    travelled: Array
    seconds: float

    def __len__(self) -> int:
        return len(self.chosen)


def make_schedule(library: Sequence[Piece], chosen: Sequence[int], rig: Rig) -> Schedule:
    """The pieces `chosen`, which may repeat, in the order in which they are run, with the times between them."""
    copies: dict[int, int] = {}
    keys: list[tuple[int, float, int, int]] = []
    for index in chosen:
        copy = copies.get(index, 0)
        copies[index] = copy + 1
        stage = STAGES.index(library[index].stage)
        stage = max(stage, REPEATED_STAGE) if copy else stage
        keys.append((stage, library[index].temperature, copy, index))
    order = [key[-1] for key in sorted(keys)]
    now, travel, temperature, crank = 0.0, 0.0, REFERENCE_TEMPERATURE, None
    begin: list[float] = []
    travelled: list[float] = []
    for index in order:
        piece = library[index]
        if crank is not None:
            travel += abs(float(piece.crank[0]) - crank)
            now += SETTING_TIME
        if piece.temperature != temperature and rig.heating_rate > 0:
            now += abs(piece.temperature - temperature) / rig.heating_rate
        begin.append(now + float(piece.step[0]))
        travelled.append(travel)
        now, travel = now + piece.seconds, travel + piece.travel
        temperature, crank = piece.temperature, float(piece.crank[-1])
    return Schedule(tuple(order), tuple(library[k] for k in order), np.array(begin), np.array(travelled), now)


def duration_text(seconds: float) -> str:
    """A duration in words: in seconds below a minute, in tenths of a minute below ten, else in minutes.

    >>> duration_text(10.42), duration_text(59.6), duration_text(372.0), duration_text(1537.0)
    ('10 s', '1 min', '6.2 min', '26 min')
    """
    if round(seconds) < 60:
        return f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{round(minutes, 1):g} min" if minutes < 10 else f"{minutes:.0f} min"


def motion_record(schedule: Schedule, ratio: float, missing: Sequence[str] = ()) -> Record:
    """The set points as a record without torque; missing: columns that the rig does not measure."""
    pieces = schedule.pieces
    time = [begin + np.cumsum(p.step) - p.step[0] for begin, p in zip(schedule.begin, pieces, strict=True)]
    crank, twist = np.concatenate([p.crank for p in pieces]), np.concatenate([p.twist for p in pieces])
    columns = {
        "time": np.concatenate(time),
        "run": run_numbers(schedule).astype(float),
        "crank_angle": crank,
        "output_angle": crank / ratio - twist,
        "output_torque": np.zeros(len(crank)),
        "temperature": np.concatenate([np.full(len(p), p.temperature) for p in pieces]),
    }
    return replace(make_record(columns, "protocol"), missing=tuple(missing))


def run_numbers(schedule: Schedule) -> NDArray[np.int64]:
    """(n,) number of the run of every sample, from 1."""
    return np.repeat(np.arange(1, len(schedule) + 1), [len(p) for p in schedule.pieces])


def measured_record(
    drive: Drive,
    rig: Rig,
    schedule: Schedule,
    seed: int,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    individual: bool = False,
) -> Record:
    """The record that the mean drive, or an individual drive, gives on this rig with effects of these parameter values.

    seed: of an individual's deviations and of the noise. The rig states torque_noise (`Rig.for_drive`).
    """
    assert rig.torque_noise is not None
    streams = _streams(schedule, seed)
    one = _individual_seed(schedule, seed) if individual else None
    true = motion_record(schedule, drive.ratio, rig.missing)
    torque = simulate_record(build_model(drive, effects, individual=one), true)["measured.tau"]
    runs = [np.flatnonzero(true.run == number) for number in np.unique(true.run)]
    noisy = torque.copy()
    rng = np.random.default_rng(streams[1])
    for run, piece in zip(runs, schedule.pieces, strict=True):
        noisy[run] += rig.torque_noise * autocorrelated(rng, piece.step, rig.correlation_time)
    angles = [
        _read(true_angle, noise, resolution, np.random.default_rng(stream))
        for true_angle, noise, resolution, stream in (
            (true.crank_angle, rig.crank_noise if rig.can_set_angles else 0.0, rig.crank_resolution, streams[2]),
            (true.output_angle, rig.output_noise, rig.output_resolution, streams[3]),
        )
    ]
    return replace(
        true,
        output_torque=_round(noisy, rig.torque_resolution),
        crank_angle=angles[0],
        output_angle=angles[1],
    )


def _individual_seed(schedule: Schedule, seed: int) -> int:
    return int(_streams(schedule, seed)[0].generate_state(1)[0])


def _streams(schedule: Schedule, seed: int) -> list[np.random.SeedSequence]:
    """Of the individual and of the noise of torque, crank angle and output angle."""
    return np.random.SeedSequence([seed, len(schedule)]).spawn(4)


def has_individuals(drive: Drive) -> bool:
    """Whether individual drives of a drawing can be simulated: between rigid bodies, element by element."""
    try:
        draw_individual(drive, 0)
    except InputError:
        return False
    return True


def autocorrelated(rng: np.random.Generator, step: Array, correlation_time: float) -> Array:
    """(n,) first-order autoregressive noise of unit variance, sampled with these steps, s, of which the median counts.

    >>> rng = np.random.default_rng(0)
    >>> noise = autocorrelated(rng, np.full(20000, 0.01), 0.02)
    >>> round(float(np.corrcoef(noise[1:], noise[:-1])[0, 1]), 1)
    0.6
    """
    white = rng.standard_normal(len(step))
    rho = float(np.exp(-np.median(step) / correlation_time)) if correlation_time > 0 else 0.0
    if rho < 1e-6:
        return white
    innovation = np.sqrt(1 - rho**2)
    white[0] /= innovation
    return np.asarray(lfilter([innovation], [1.0, -rho], white), float)


def _read(angle: Array, noise: float, resolution: float, rng: np.random.Generator) -> Array:
    return _round(angle + noise * rng.standard_normal(len(angle)), resolution)


def _round(values: Array, resolution: float) -> Array:
    return values if resolution == 0 else resolution * np.round(values / resolution)
