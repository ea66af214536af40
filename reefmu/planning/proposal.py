"""The next experiment that a diagnosis proposes: planned for the explanations that its record leaves open."""

from __future__ import annotations

import numpy as np

from stiffness_model.errors import InputError

from ..diagnosis.analysis import Analysis, ProposedExperiment
from ..diagnosis.hypotheses import listed
from ..diagnosis.random_effects.tolerance_scatter import Spread, in_turn
from ..diagnosis.schema import Diagnosis
from ..model.contacts.tables import cached_lookup
from .next_experiment import NextProtocol, next_protocol, rig_of_record
from .plan_report.protocol_table import protocol_csv
from .protocols.schedule import duration_text

OPEN = 0.05
"""Probability from which an explanation is still open, one case in twenty; chosen by judgement."""
MAX_RIVALS = 4
"""Explanations that are told apart at most, the likeliest of them, to bound the time."""
DECISIVE = 0.5
"""Mean probability of the right name below which a protocol decides nothing and is not written; chosen by judgement."""


def propose_protocol(found: Analysis, spread: Spread = in_turn) -> ProposedExperiment | None:
    """The shortest protocol, on the rig that the record shows, that tells the open explanations apart.

    None where fewer than two sets of effects are open, or where no drawing of a rolling element eccentric drive is
    given, for which alone tests are planned. spread: shares the work among processes, with the same result.
    """
    problem = found.evidence.problem
    drive, rivals = problem.base.drive, open_explanations(found.diagnosis)
    if drive is None or len(rivals) < 2:
        return None
    rig = rig_of_record(found.record, drive.ratio, problem.noise.torque, problem.noise.twist)
    try:
        protocol = next_protocol(drive, rig, rivals, spread)
    except InputError:  # the rig's columns show fewer than two of them
        return None
    if protocol.told_apart < DECISIVE:
        return ProposedExperiment(_no_protocol(protocol), "")
    twist = np.concatenate([piece.twist for piece in protocol.schedule.pieces])
    torque = np.asarray(cached_lookup(drive).torque(twist))
    return ProposedExperiment(_sentence(protocol), protocol_csv(protocol.schedule, drive, torque))


def open_explanations(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """Sets of effects that may be the missing ones, with or without something unnamed beside, the likeliest first; of
    an ambiguous verdict all its sets. Named effects with one more that does not show are no other explanation."""
    probability: dict[tuple[str, ...], float] = {}
    for hypothesis in diagnosis.hypotheses:
        names = tuple(sorted(hypothesis.effects))
        probability[names] = probability.get(names, 0.0) + hypothesis.probability
    own = tuple(sorted(effect.name for effect in diagnosis.effects))
    shown = [tuple(sorted(names)) for names in (own, *diagnosis.shown_alternatives) if names]
    hidden = {names for names in probability if own and set(names) > set(own) and names not in shown}
    possible = [names for names, p in probability.items() if names and p >= OPEN and names not in hidden]
    likely = sorted(possible, key=lambda names: -probability[names])
    reported = shown if diagnosis.verdict == "ambiguous" else []
    return tuple(dict.fromkeys((*reported, *likely)))[:MAX_RIVALS]


def _sentence(found: NextProtocol) -> str:
    runs = len(found.schedule.pieces)
    return (
        f"next_protocol.csv tells {listed(found.labels)} apart on this rig: {runs} {'runs' if runs > 1 else 'run'}, "
        f"{duration_text(found.schedule.seconds)}; at typical sizes it names the right one in at most "
        f"{_percent(found)} % of cases"
    )


def _no_protocol(found: NextProtocol) -> str:
    percent, rarely = _percent(found), "none is ever named"
    if percent:
        rarely = f"the best one would name the right one in at most {percent} % of cases"
    return f"no protocol on the rig of this record tells {listed(found.labels)} apart: at typical sizes {rarely}"


def _percent(found: NextProtocol) -> int:
    # Never certain: laws and covariance are taken as known.
    return min(99, round(100 * found.told_apart))
