"""Equilibrium of the elements between gear, crank and cage: displacements, forces, torque, with a status for each.

* `closed_form`: entry point, and elements whose contacts all follow Hertz's power law, by the equations of
  `closed_form_pass`; `solution`: status, forces and displacements.
* `newton`: elements without a closed form, by minimising their stored energy.
* `coupled_elements`: drives with a compliant bearing or housing (`shared_bodies`) or other contact laws, whose elements
  are solved by `closed_form_elements` and `iterated_elements`.
* `reference`: the paper's root search, an independent solution for tests.
"""
