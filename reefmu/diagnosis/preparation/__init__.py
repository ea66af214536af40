"""From a record and a base curve to the problem that is solved.

`base_curve_source`: where the base curve comes from; `prepare`: noise, scatter, weights and candidates;
`channel_time_constant`: the filter that all channels have passed; `first_element`: where the first element of an
individual stands; `friction_at_start`: friction that is built up when a run starts.
"""

from .base_curve_source import BaseCurveSource
from .first_element import may_stand_anywhere, with_first_element
from .friction_at_start import with_friction_at_start
from .prepare import guess_stiffness, prepare_problem, prepare_same_motion, with_individuals

__all__ = [
    "BaseCurveSource",
    "guess_stiffness",
    "may_stand_anywhere",
    "prepare_problem",
    "prepare_same_motion",
    "with_first_element",
    "with_friction_at_start",
    "with_individuals",
]
