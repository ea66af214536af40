"""What a conclusion is drawn from. Costs are -2 log likelihood, gains are differences of costs."""

from __future__ import annotations

from dataclasses import dataclass

from ..estimation.problem import Problem
from ..estimation.search import Search


@dataclass(frozen=True)
class Evidence:
    """problem: the record, its noise and scatter; search: the sets of effects that were fitted."""

    problem: Problem
    search: Search
