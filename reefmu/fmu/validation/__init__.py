"""An FMU checked against the standard and against the Python model.

* `fmu_check`: all tests of one file; `check_report`: their results.
* `static_checks` and `fmi3_rules`: tests of the description.
* `run_checks`: tests of the runs, with the excitation of `reference_run` and the differences of `derivatives`.
"""
