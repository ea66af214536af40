"""The code that runs inside an FMU of the Python back end.

* `equations_file`: the equations that the FMU contains; `slave`: the FMI calls on them, behind pythonfmu.
* `workarounds`: faults of pythonfmu 0.7 and their remedies.
* `dependencies`: what the host must provide; `real_time`: whether a step keeps up with real time.
"""
