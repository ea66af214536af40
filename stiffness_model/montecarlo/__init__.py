"""Many virtual drives at once.

* `virtual_drives`: torque, contact forces and load shares over the twist, for every kind of drives; `population`: those
  of rolling element eccentric drives; `twist_torque_curve`: their mean and band.
* `drive_blocks`: torques and forces of a block of drives; `solved_blocks`: the equilibrium of every element, a block of
  drives at a time.
"""
