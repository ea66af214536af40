"""From a record and a base curve to the problem that is solved.

`base_curve_source`: where the base curve comes from; `prepare`: noise, scatter, weights and candidates;
`channel_time_constant`: the filter that all channels have passed.
"""

from .base_curve_source import BaseCurveSource
from .prepare import guess_stiffness, prepare_problem, prepare_same_motion, with_individuals

__all__ = ["BaseCurveSource", "guess_stiffness", "prepare_problem", "prepare_same_motion", "with_individuals"]
