"""Dissipative torques: hysteresis and damping inside the drive, friction at the output shaft.

`presliding` is the Dahl state that all rate-independent ones share.
"""
