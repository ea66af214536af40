"""What a drawing says, as values: one drive, its parts' materials and tolerances, and the virtual drives drawn from it.

* `materials`, `tolerances`, `fits`: elastic constants, windows of ISO 286, 492 and 3290, and tolerance fields as a
  workshop writes them; `options`: what is switched on beyond the paper's contacts.
* `drive`: one drive, checked as a whole by `assembly_checks`; `twist_limits`: how far it may be twisted.
* `sampling`: the random deviations of virtual drives, in seeded blocks.
"""
