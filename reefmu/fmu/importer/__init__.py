"""Driving an FMU from Python.

* `instance`: parameters, steps, outputs, states by name; `ctypes_buffers` and `fmi3_adapter` speak to its library.
* `replay`: a measured record through it, with `saved_values` between the runs.
"""
