"""Measured data: CSV with `name [unit]` headers becomes a `Record` in SI units.

* `columns`: canonical names, units and ranges; `unit_conversion`: units as files write them.
* `file_text`, `table_layout`, `number_format`: from a file to a table of numbers; `column_map`: what its columns mean.
* `motor_side`: torque at the output from a motor's torque or current, or from a pendulum.
* `record`: the record; `reading`: records from files.
* `torque_cycles`: cycles that repeat in torque, and their spread.
"""

from .column_map import ColumnMap, make_column_map, read_column_map
from .columns import ANGLE_LIMIT, COLUMNS, RANGES, REPLACED_BY, check_range
from .motor_side import TORQUE_SIDES, Pendulum, TorqueConstants
from .reading import ColumnReading, Columns, FileReading, read_file, read_record
from .record import Record, join_records, make_record, with_output_locked, with_twist_zero
from .torque_cycles import (
    LEVELS,
    CycleSpread,
    TorqueBranch,
    level_means,
    repeated_branches,
    repeats_branch,
    torque_branches,
    torque_cycle_spread,
)
from .unit_conversion import convert_units

__all__ = [
    "ANGLE_LIMIT",
    "COLUMNS",
    "ColumnMap",
    "ColumnReading",
    "Columns",
    "CycleSpread",
    "FileReading",
    "LEVELS",
    "Pendulum",
    "RANGES",
    "REPLACED_BY",
    "Record",
    "TORQUE_SIDES",
    "TorqueBranch",
    "TorqueConstants",
    "check_range",
    "convert_units",
    "join_records",
    "level_means",
    "make_column_map",
    "make_record",
    "read_column_map",
    "read_file",
    "read_record",
    "repeated_branches",
    "repeats_branch",
    "torque_branches",
    "torque_cycle_spread",
    "with_output_locked",
    "with_twist_zero",
]
