"""What changed between states of one drive, from quantities that need no model of it.

* `torque_loops`: full cycles of the torque as middle line and half width; `loop_quantities`: play, friction and
  stiffness of a cycle; `drive_states`: states with their positions, and which cycles count.
* `position_scatter`: the posterior of states that scatter from position to position; `state_changes`: differences
  between states; `comparison_files`, `comparison_page`, `comparison_text`: the results for readers.
"""

from .comparison_files import write_comparison
from .comparison_text import comparison_text
from .drive_states import DriveState
from .state_changes import Change, StateComparison, compare_states

__all__ = ["Change", "StateComparison", "DriveState", "compare_states", "comparison_text", "write_comparison"]
