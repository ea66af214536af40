"""Which hypotheses a verdict covers, which are its rivals, and which effects matter for telling them apart."""

from __future__ import annotations

from ..hypotheses import MIN_SHOWN, Hypothesis, likeliest
from ..schema import Diagnosis

MAX_RIVALS = 5
"""Rivals that the report shows at most, for a reader's sake."""
MAX_EFFECTS = 10
"""Effects of the isolability matrix that the report shows at most, which still fit a narrow window."""
CONFUSABLE = 0.05
"""Probability of naming one effect for another from which both are shown: the error that verdicts admit."""


def is_reported(diagnosis: Diagnosis, hypothesis: Hypothesis) -> bool:
    """Whether the verdict covers a hypothesis; an ambiguous verdict covers several."""
    if diagnosis.verdict == "ambiguous":
        sets = [frozenset(names) for names in ((e.name for e in diagnosis.effects), *diagnosis.alternatives)]
        return frozenset(hypothesis.effects) in sets
    return _is_chosen(diagnosis, hypothesis)


def _is_chosen(diagnosis: Diagnosis, hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is the one whose effects the diagnosis gives, with their sizes."""
    unnamed = diagnosis.verdict in ("partly", "unknown")
    return {e.name for e in diagnosis.effects} == set(hypothesis.effects) and unnamed == hypothesis.unnamed


def rivals(diagnosis: Diagnosis) -> tuple[Hypothesis, ...]:
    """The likeliest hypotheses other than the chosen one."""
    others = [h for h in diagnosis.hypotheses if not _is_chosen(diagnosis, h)]
    return tuple(h for h in likeliest(others, MAX_RIVALS) if h.probability >= MIN_SHOWN)


def relevant_effects(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Effects of the isolability matrix that matter here: the named ones, their rivals, and what may be taken for one
    of these. Where none is named, or these are fewer than two, also those that the record identifies worst and may
    therefore hide."""
    isolability = diagnosis.isolability
    if isolability is None:
        return ()
    index = {name: k for k, name in enumerate(isolability.names)}
    sets = [h.effects for h in rivals(diagnosis)]
    if diagnosis.verdict == "ambiguous":
        sets += list(diagnosis.shown_alternatives)
    first = [e.name for e in diagnosis.effects] + [name for names in sets for name in names]
    chosen = [name for name in dict.fromkeys(first) if name in index]

    def confusion(name: str) -> float:
        k, matrix = index[name], isolability.matrix
        return max((max(matrix[k][index[c]], matrix[index[c]][k]) for c in chosen), default=0.0)

    others = [name for name in isolability.names if name not in chosen]
    chosen += sorted((name for name in others if confusion(name) >= CONFUSABLE), key=confusion, reverse=True)
    if not diagnosis.effects or len(chosen) < 2:
        others = [name for name in isolability.names if name not in chosen]
        chosen += sorted(others, key=lambda name: isolability.matrix[index[name]][index[name]])
    return tuple(chosen[:MAX_EFFECTS])
