"""Equilibrium of the elements between gear, crank and cage: displacements, forces, torque, with a status for each.

* `closed_form`: one division per element and pass, for what Hertz's laws alone hold; `result`: what comes of it.
* `newton`: the elements without a closed form; `external_load`: further forces and the exact profile.
* `elements`, `frame`, `coupled_elements`: elements that feel each other through bearings and housing.
* `reference`: the paper's own root search, an independent solution for tests.
"""
