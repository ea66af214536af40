"""The text of an inspection: what was understood of a record, as a reader checks it."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

import numpy as np

from stiffness_model.units import ARCMIN, DISPLAY_UNITS

from ..diagnosis.hypotheses import listed
from ..record import COLUMNS, TORQUE_SIDES, ColumnReading
from ..record.motor_side import MOTOR_COLUMNS
from ..record.table_layout import SEPARATORS
from .record_inspection import RecordInspection

WIDTH, LABEL = 110, 14
"""Characters of a line, and of the label before it."""
MAX_RUNS = 12
"""Runs that are listed; of more, the first and the last ones are."""


def inspection_text(found: RecordInspection, command: str) -> str:
    """The text of an inspection, several lines; command: with which the record is diagnosed next."""
    record = found.reading.record
    runs = f"{len(found.runs)} run{'s' if len(found.runs) != 1 else ''}"
    lines = [f"{record.source}: {len(record)} samples, {runs}, {found.duration:.4g} s"]
    lines += _labelled("file", [_file(found)])
    lines += _labelled("columns", _columns(found))
    lines += _labelled("torque", [TORQUE_SIDES[record.torque_side], *_conversion(found)])
    lines += _labelled("sampling", _sampling(found))
    lines += _labelled("ranges", _ranges(found))
    lines += _labelled("runs", _runs(found))
    lines += _labelled("repeats", _repeats(found))
    lines += _labelled("can show", _can_show(found))
    lines += _labelled("cannot show", _cannot_show(found))
    lines += _labelled("notes", list(found.diagnosis.notes))
    return "\n".join([*lines, "next", f"  {command}"])


def _labelled(label: str, texts: Sequence[str]) -> list[str]:
    """Texts of one subject, wrapped, behind its label."""
    lines: list[str] = []
    for text in texts:
        lines += wrap(text, WIDTH - LABEL, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return [f"{label if k == 0 else '':<{LABEL}}{line}" for k, line in enumerate(lines)]


def _file(found: RecordInspection) -> str:
    reading, layout = found.reading, found.reading.layout
    parts = [
        reading.encoding,
        f"columns separated by {SEPARATORS[layout.separator]}",
        "decimal comma" if reading.decimal == "," else "decimal point",
    ]
    if layout.skipped:
        parts.append(f"{layout.skipped} line{'s' if layout.skipped > 1 else ''} before the header")
    if layout.header_in_comment:
        parts.append("header in a comment")
    if layout.has_units_row:
        parts.append("a row of units")
    return ", ".join(parts)


def _columns(found: RecordInspection) -> list[str]:
    texts = [_column(column) for column in found.reading.columns]
    if found.reading.ignored:
        texts.append("not used: " + ", ".join(found.reading.ignored))
    if found.reading.record.missing:
        texts.append("missing: " + ", ".join(found.reading.record.missing))
    return texts


def _column(column: ColumnReading) -> str:
    unit = COLUMNS[column.name]
    target = f"{column.name} [{unit}]" if unit else column.name
    factor = column.sign * column.scale
    terms = [] if factor == 1.0 else [f"x {factor:.7g}"]
    if column.offset:
        terms.append(f"{'+' if column.offset > 0 else '-'} {abs(column.offset):.6g}")
    stated = f", [{column.unit}] by the {column.stated_in}" if column.unit else ""
    return f"{column.title} -> {target}{stated}" + (f" ({' '.join(terms)})" if terms else "")


def _sampling(found: RecordInspection) -> list[str]:
    sampled = found.sampling
    if sampled.rate == 0.0:
        return ["the time does not advance within the runs"]
    text = f"{sampled.rate:.4g} Hz"
    if sampled.coarse_clock:
        text += (
            f" on average; the clock is coarse: it advances by {_duration(sampled.step)}, and "
            f"{100 * sampled.shared_stamps:.0f} % of the samples have the time stamp of the one before"
        )
    elif sampled.irregular:
        text += f" on average, irregular: the median step is {_duration(sampled.step)}"
    return [text + f"; longest step {_duration(sampled.longest_step)}"]


def _conversion(found: RecordInspection) -> list[str]:
    """How the torque follows from other columns, in a sentence, or nothing."""
    constants = found.reading.column_map.constants
    names = [column.name for column in found.reading.columns]
    hanging = constants.pendulum
    weight = (
        "" if hanging is None else f"a pendulum of {hanging.mass:g} kg at {hanging.length:g} m on the {hanging.shaft}"
    )
    texts = [f"that of {weight}"] if hanging is not None and hanging.shaft == "output" else []
    at_motor = [name for name in MOTOR_COLUMNS if name in names]
    if not at_motor:
        return texts
    source, beside = at_motor[0], found.reading.record.crank_torque is not None
    factors = [source]
    if constants.torque_constant is not None:
        factors.append(f"torque constant {constants.torque_constant:g} N.m/A")
    if beside:
        texts.append("the motor's torque is measured beside it")
    elif constants.ratio is not None and source != "referred_motor_torque":
        factors.append(f"ratio {constants.ratio:g}")
    less = [f"motor inertia {constants.motor_inertia:g} kg.m2"] if constants.motor_inertia is not None else []
    less += [weight] if hanging is not None and hanging.shaft == "crank" else []
    text = " x ".join(factors) + (f", less {' and '.join(less)}" if less else "")
    return [*texts, text] if len(factors) > 1 or less else texts


def _duration(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def _ranges(found: RecordInspection) -> list[str]:
    texts: list[str] = []
    for name, (low, high) in found.ranges.items():
        unit = COLUMNS[name]
        # The crank's and the output's angle are turns, for which arcmin are too small.
        size, shown = DISPLAY_UNITS.get(unit, (1.0, unit)) if name == "twist" else (1.0, unit)
        text = f"{name} {low / size:.4g} ... {high / size:.4g} {shown}"
        if (step := found.quantisation.get(name)) is not None:
            text += f", in steps of {step / size:.3g} {shown}"
        texts.append(text)
    if found.diagnosis.ratio is not None:
        texts.append(f"ratio {found.diagnosis.ratio:g}, crank to output")
    return texts


def _runs(found: RecordInspection) -> list[str]:
    half = MAX_RUNS // 2
    shown = found.runs if len(found.runs) <= MAX_RUNS else found.runs[:half] + found.runs[-half:]
    texts = [
        f"{run.run}: {run.samples} samples, {run.duration:.4g} s, {run.torque[0]:.3g} ... {run.torque[1]:.3g} N.m, "
        f"{run.twist[0] / ARCMIN:.4g} ... {run.twist[1] / ARCMIN:.4g} arcmin"
        for run in shown
    ]
    if len(shown) < len(found.runs):
        texts.insert(half, f"... {len(found.runs) - len(shown)} further runs")
    return texts


def _repeats(found: RecordInspection) -> list[str]:
    pairs = found.diagnosis.pairs_in_time
    texts = [f"in time: {pairs} pairs of cycles" if pairs else "in time: no cycles"]
    cycles = found.cycles
    if not cycles.groups:
        return [*texts, "in torque: no cycles"]
    branches = sum(len(group.branches) for group in cycles.groups)
    texts.append(
        f"in torque: {branches} of {cycles.branches} branches; standard deviation between cycles: "
        f"twist at equal torque {cycles.twist / ARCMIN:.3g} arcmin, torque at equal twist {_torque(cycles.torque)}"
    )
    for group in cycles.groups:
        start, end = (float(np.mean([getattr(b, name) for b in group.branches])) for name in ("start", "end"))
        texts.append(
            f"  {_plain(start)} to {_plain(end)} N.m, {branches_text([branch.run for branch in group.branches])}: "
            f"{group.twist / ARCMIN:.3g} arcmin, {_torque(group.torque)}"
        )
    return texts


def branches_text(runs: Sequence[int]) -> str:
    """Branches of cycles by the runs that hold them.

    >>> branches_text([0, 0, 0]), branches_text([1, 2, 2]), branches_text([4])
    ('3 branches of run 0', '3 branches of runs 1 and 2', '1 branch of run 4')
    """
    names = [str(run) for run in dict.fromkeys(runs)]
    branches, of_runs = "branch" if len(runs) == 1 else "branches", "run" if len(names) == 1 else "runs"
    return f"{len(runs)} {branches} of {of_runs} {listed(names)}"


def _plain(value: float) -> str:
    """Two significant digits without an exponent."""
    return f"{float(f'{value:.2g}'):.10g}"


def _torque(spread: float) -> str:
    return f"{spread:.2g} N.m" if np.isfinite(spread) else "none (the twist sticks)"


def _can_show(found: RecordInspection) -> list[str]:
    able = found.diagnosis
    if able.defects and able.shows_twist:
        return ["nothing as it is: " + "; ".join(able.defects)]
    without, drawn = able.candidates["power law"], able.candidates["drawing"]
    texts = [", ".join(without) if without else "nothing"]
    if further := [name for name in drawn if name not in without]:
        texts.append("with a drawing also: " + ", ".join(further))
    if able.shows_losses:
        texts.append("friction at the crank and efficiencies, from the torques of crank and output")
    if found.reading.record.torque_side == "motor":
        texts.append("friction that is found is that of motor, crank and drive together")
    return texts


def _cannot_show(found: RecordInspection) -> list[str]:
    reasons: dict[str, list[str]] = {}
    for name, reason in found.diagnosis.excluded["drawing"].items():
        reasons.setdefault(reason, []).append(name)
    texts = [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]
    return [
        *texts,
        *(f"no diagnosis: {defect}" for defect in found.diagnosis.defects if not found.diagnosis.shows_twist),
    ]
