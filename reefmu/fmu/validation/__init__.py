"""An FMU held against the standard and against the Python model.

* `check`: all findings; `reference_run`: the signal and the two runs; `derivatives`; `fmi3_rules`: rules of FMI 3.0.
"""
