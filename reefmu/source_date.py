"""The date that files carry: SOURCE_DATE_EPOCH where it is set (reproducible-builds.org), never the clock's."""

from __future__ import annotations

import os
from datetime import UTC, datetime

from stiffness_model.errors import expect

LATEST = 4354819198
"""s since 1970: the end of 2107, the latest date in a zip archive (APPNOTE.TXT 4.4.6: 7 bits from 1980)."""


def source_date(default: datetime) -> datetime:
    """The date of SOURCE_DATE_EPOCH, or `default` where it is not set. Raises `InputError` if it is not a date.

    Commands call this before they load NumPy, which reads the variable too and fails with a traceback.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch:
        return default
    expect(
        epoch.isascii() and epoch.isdigit() and len(epoch) < 12 and int(epoch) <= LATEST,
        f"seconds since 1970, a whole number up to {LATEST}",
        epoch,
        "SOURCE_DATE_EPOCH",
    )
    return datetime.fromtimestamp(int(epoch), UTC)
