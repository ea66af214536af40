"""The content of an FMU, independent of the back end.

* `component`: signals, parameters and functions of kind `drive`; `joint_component`, `joint_equations`: of kind `joint`.
* `start`: states at the start, from start values or in equilibrium under a torque; `presets`: sets of parameter values.
* `nominals`: nominal values and the default experiment; `base_units`: units in SI base units.
* `variables`: variables and interface of an FMU; `declaration`: the interface of a component.
* `table_encoding`: the lookup as C source; `kernel`: the functions on one array of doubles.
"""
