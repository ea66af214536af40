"""What a record can be diagnosed for, by the rules of the diagnosis itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError

from ..diagnosis.fitted_values import CrankLosses
from ..diagnosis.losses.crank_losses import crank_losses, with_losses
from ..diagnosis.preprocessing.audit import audit, ratio_from_angles
from ..diagnosis.preprocessing.noise import matching_cycles
from ..diagnosis.preprocessing.trace import make_trace
from ..effects.effect_facts import select_candidates
from ..record import Record

BASES = ("drawing", "power law")
"""Kinds of base curves, by which the effects that can be named differ."""


@dataclass(frozen=True)
class Diagnosability:
    """ratio: signed, crank to output, None where the record does not show it; shows_twist: whether the twist is known
    all the same, because a shaft is locked; candidates: effects that can be named, by the kind of the base curve;
    excluded: the others with the reason; defects: each of them prevents a diagnosis; notes: on the record's quality;
    pairs_in_time: pairs of cycles of the twist that repeat in time; shows_losses: whether the torques of crank and
    output show friction at the crank."""

    ratio: float | None
    shows_twist: bool
    candidates: Mapping[str, tuple[str, ...]]
    excluded: Mapping[str, Mapping[str, str]]
    defects: tuple[str, ...]
    notes: tuple[str, ...]
    pairs_in_time: int
    shows_losses: bool = False


def diagnosability(record: Record, drive: Drive | None = None) -> Diagnosability:
    """What a record can be diagnosed for; drive: gives the ratio where there is a drawing."""
    candidates: dict[str, tuple[str, ...]] = {}
    excluded: dict[str, dict[str, str]] = {}
    for base in BASES:
        candidates[base], excluded[base] = select_candidates(_uninformative_columns(record), base)
    try:
        ratio = ratio_from_angles(record) if drive is None else drive.ratio
    except InputError as error:
        where = f"{record.source or 'record'}: "
        defect = f"without a drawing: {str(error).removeprefix(where)}"
        return Diagnosability(None, False, candidates, excluded, (defect,), (), 0)
    audited = audit(record, ratio)
    pairs = 0 if audited.defects else len(matching_cycles(make_trace(record, ratio)))
    shows_losses = False
    if record.crank_torque is not None and not audited.defects:
        losses = crank_losses(record, ratio)
        shows_losses = isinstance(losses, CrankLosses)
        excluded = {base: with_losses(reasons, losses) for base, reasons in excluded.items()}
    return Diagnosability(ratio, True, candidates, excluded, audited.defects, audited.notes, pairs, shows_losses)


def _uninformative_columns(record: Record) -> tuple[str, ...]:
    """Columns that the record lacks, and those whose constant value shows as little: that of a temperature."""
    is_constant = "temperature" not in record.missing and float(np.ptp(record.temperature)) == 0
    return (*record.missing, "temperature") if is_constant else tuple(record.missing)
