"""The audit of a record: what it notes, and what it does not."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.preprocessing.audit import audit, ratio_from_angles
from reefmu.record import Record, make_record, with_output_locked


def record(gaps: tuple[int, ...], slow_run: int | None = None) -> Record:
    """Four runs of 100 samples at 100 Hz; gaps: numbers of samples before which a minute is missing; slow_run: run that
    is sampled a hundred times slower."""
    step = np.full(400, 0.01)
    if slow_run is not None:
        step[100 * slow_run : 100 * (slow_run + 1)] = 1.0
    step[list(gaps)] += 60.0
    phase = 0.2 * np.arange(400)
    run = np.repeat(np.arange(4.0), 100)
    return make_record(
        {"time": np.cumsum(step), "run": run, "twist": 1e-3 * np.sin(phase), "output_torque": 50 * np.sin(phase)}
    )


@pytest.mark.parametrize(
    ("gaps", "slow_run", "note"),
    [
        ((), None, None),
        ((150,), None, "1 gap in time within runs"),
        ((20, 150, 350), None, "3 gaps in time within runs"),
        ((100, 200, 300), None, None),
        ((), 2, None),
        ((350,), 2, "1 gap in time within runs"),
    ],
)
def test_gaps_within_runs_are_noted(gaps: tuple[int, ...], slow_run: int | None, note: str | None) -> None:
    """A pause between two runs is no gap, nor is the step of a run that is sampled more slowly."""
    notes = [text for text in audit(record(gaps, slow_run), 1.0).notes if "gap" in text]
    assert notes == ([] if note is None else [note])


@pytest.mark.parametrize("ratio", [None, -29.0])
def test_the_audit_says_which_shaft_is_locked(ratio: float | None) -> None:
    """A record of a twist alone leaves open what moved; its twist is the same whichever shaft is locked."""
    crank_locked = record(())
    output_locked = with_output_locked(crank_locked, ratio)
    notes = [audit(r, ratio).notes[0] for r in (crank_locked, output_locked)]
    assert notes == [
        "no crank angle: the crank is taken as locked",
        "no crank angle: the output is taken as locked while the crank turns",
    ]
    np.testing.assert_allclose(output_locked.twist(ratio), crank_locked.twist(ratio), rtol=1e-12)
    assert [ratio_from_angles(r) for r in (crank_locked, output_locked)] == [None, None]
