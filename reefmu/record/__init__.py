"""Measured data: CSV with `name [unit]` headers becomes a `Record` in SI units.

* `columns`: canonical names, units and ranges; `record`: the record; `reading`: records from files.
"""

from .columns import ANGLE_LIMIT, COLUMNS, RANGES, check_range, convert_units
from .reading import read_record
from .record import Record, join_records, make_record, with_output_locked

__all__ = [
    "ANGLE_LIMIT",
    "COLUMNS",
    "RANGES",
    "Record",
    "check_range",
    "convert_units",
    "join_records",
    "make_record",
    "read_record",
    "with_output_locked",
]
