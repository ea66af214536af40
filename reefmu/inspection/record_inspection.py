"""What a record holds: how its file was read, runs, sampling, ranges, repeats, and what can be diagnosed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from stiffness_model.drawing.drive import Drive

from ..record import TORQUE_SIDES, CycleSpread, FileReading, torque_cycle_spread, with_output_locked
from ..record.table_layout import SEPARATORS
from .diagnosability import Diagnosability, diagnosability
from .sampling import RunSummary, Sampling, quantisation_step, run_summaries, sampling, value_range

SCHEMA = 1
"""Version of the keys of `RecordInspection.to_dict`."""


@dataclass(frozen=True)
class RecordInspection:
    """reading: how the file was read; ranges: least and greatest value by signal, in the unit that it names;
    quantisation: steps by signal, in the same units, of those that have steps; cycles: spread of cycles that repeat in
    torque. The other fields are described by their types."""

    reading: FileReading
    runs: tuple[RunSummary, ...]
    sampling: Sampling
    ranges: Mapping[str, tuple[float, float]]
    quantisation: Mapping[str, float]
    cycles: CycleSpread
    diagnosis: Diagnosability

    @property
    def duration(self) -> float:
        """s, of all runs together."""
        return sum(run.duration for run in self.runs)

    def to_dict(self) -> dict[str, Any]:
        """All fields for JSON, in SI units and degC; numbers that do not exist are None."""
        reading = self.reading
        record, layout = reading.record, reading.layout
        groups = [
            {
                "runs": [branch.run for branch in group.branches],
                "torque_start": float(np.mean([branch.start for branch in group.branches])),
                "torque_end": float(np.mean([branch.end for branch in group.branches])),
                "twist_spread": group.twist,
                "torque_spread": group.torque,
            }
            for group in self.cycles.groups
        ]
        return _without_nan(
            {
                "schema": SCHEMA,
                "source": record.source,
                "file": {
                    "encoding": reading.encoding,
                    "separator": SEPARATORS[layout.separator],
                    "decimal": reading.decimal,
                    "lines_before_header": layout.skipped,
                    "units_row": layout.has_units_row,
                },
                "columns": [asdict(column) for column in reading.columns],
                "ignored": list(reading.ignored),
                "missing": list(record.missing),
                "torque_side": record.torque_side,
                "torque_constants": asdict(reading.column_map.constants),
                "torque_contains": TORQUE_SIDES[record.torque_side],
                "samples": len(record),
                "duration": self.duration,
                "runs": [asdict(run) for run in self.runs],
                "sampling": asdict(self.sampling) | {"coarse_clock": self.sampling.coarse_clock},
                "ranges": {name: list(values) for name, values in self.ranges.items()},
                "quantisation": dict(self.quantisation),
                "repeats": {
                    "pairs_in_time": self.diagnosis.pairs_in_time,
                    "branches": self.cycles.branches,
                    "twist_spread": self.cycles.twist,
                    "torque_spread": self.cycles.torque,
                    "groups": groups,
                },
                "ratio": self.diagnosis.ratio,
                "candidates": {base: list(names) for base, names in self.diagnosis.candidates.items()},
                "excluded": {base: dict(names) for base, names in self.diagnosis.excluded.items()},
                "defects": list(self.diagnosis.defects),
                "notes": list(self.diagnosis.notes),
            }
        )


def inspect_record(
    reading: FileReading, drive: Drive | None = None, *, output_locked: bool = False
) -> RecordInspection:
    """What the record of a file holds.

    drive: gives the ratio where there is a drawing; output_locked: for a record of a twist alone, that the crank turned
    while the output was locked (see `reefmu.record.with_output_locked`).
    """
    record = reading.record
    if output_locked:
        record = with_output_locked(record, None if drive is None else drive.ratio)
        reading = replace(reading, record=record)
    able = diagnosability(record, drive)
    # Where the twist of a record with two angles is not known, its runs show the output's angle.
    twist = record.twist(able.ratio) if able.shows_twist else -record.output_angle
    signals = {"twist": twist} if able.shows_twist else {"output_angle": record.output_angle}
    signals["output_torque"] = record.output_torque
    if "crank_angle" not in record.missing:
        signals |= {"crank_angle": record.crank_angle, "output_angle": record.output_angle}
    if "temperature" not in record.missing:
        signals["temperature"] = record.temperature
    steps = {name: quantisation_step(values) for name, values in signals.items()}
    return RecordInspection(
        reading,
        run_summaries(record, twist),
        sampling(record),
        {name: value_range(values) for name, values in signals.items()},
        {name: step for name, step in steps.items() if step is not None},
        torque_cycle_spread(record, able.ratio),
        able,
    )


def _without_nan(value: Any) -> Any:
    """A value for JSON, in which numbers that are not finite are None."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
