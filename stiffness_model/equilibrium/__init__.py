"""Equilibrium of the elements between gear, crank and cage: displacements, forces, torque, with a status for each.

* `closed_form`: elements whose contacts all follow Hertz's power law; `solution`: status, forces and displacements.
* `newton`: elements without a closed form, by minimising their stored energy.
* `coupled_elements`: elements that share a compliant bearing or housing (`shared_bodies`) or have other contact laws,
  solved by `closed_form_elements` and `iterated_elements`.
* `reference`: the paper's root search, an independent solution for tests.
"""
