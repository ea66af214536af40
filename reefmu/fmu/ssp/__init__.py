"""Systems of FMUs in one file (System Structure and Parameterization 1.0).

    controller_stub, system_structure -> export_ssp

* `controller_stub`: the FMU of a simple controller of the motor; `system_structure`: the description of a system.
* `export_ssp`: a drive, or a joint connected with the controller, with sets of parameters.
"""
