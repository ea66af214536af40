"""What runs inside an FMU of the Python back end.

* `equations_file`: the functions that it carries; `slave`: them behind pythonfmu, whose faults `workarounds` meets.
* `dependencies`: what the host must have; `cost`: whether a step keeps up with real time.
"""
