"""Alias of `stiffness_model.rotation`, kept because published examples import from here; `turn` is the earlier name of
`angles_over_turn`.
"""

from . import rotation
from .rotation import *  # noqa: F403
from .rotation import angles_over_turn as turn

__all__ = ["turn"]
__all__ += rotation.__all__
