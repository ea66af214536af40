"""Many virtual drives at once.

* `population`: torque, forces and load shares over twist; `twist_torque_curve`: their mean and band.
* `solved_blocks`: blocks of solved drives for what needs more than torque.
"""
