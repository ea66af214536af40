"""Dissipative torques: at the crank, inside the drive (hysteresis and damping) and at the output shaft.

`presliding` is the Dahl state of those that creep under a load held below their torque, `elastoplastic` the bristle of
those that stick.
"""
