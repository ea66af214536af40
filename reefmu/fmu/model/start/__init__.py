"""The start of an FMU: values of the effects' states, and equilibrium under a torque.

* `start_parameters`: the parameters, which both kinds have.
* `start_search`: the states at the start, from the parameters.
* `starting_drive`: kind `drive`, whose angles are inputs, with its start.
"""
