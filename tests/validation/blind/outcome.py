"""One blind case: from its specification to the judged diagnosis."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from reefmu.diagnosis import diagnose_record

from .records import Case, make
from .scoring import Outcome, judge


def outcome(what: Case) -> Outcome:
    """Make a case, diagnose its record and judge the answer."""
    made = make(what)
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = made.write(Path(folder))
        start = time.perf_counter()
        answer = diagnose_record(record, drive=drawing).to_dict()
    return judge(made.truth, answer, time.perf_counter() - start)
