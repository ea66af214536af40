"""Running an FMU from Python.

* `loading`: unpacks the file, loads the library and creates an instance, through `ctypes_buffers` and `fmi3_adapter`.
* `instance`: parameters, steps, outputs and states by name.
* `replay`: the inputs of a measured record, with `saved_values` to carry states from run to run.
"""
