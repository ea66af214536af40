"""The contacts of every element: stiffness from radii and materials, for all elements of some virtual drives.

* `element_contacts`: geometry and stiffness of the contacts at gear, crank and cage, as the equilibrium needs them.
* `usable_elements`: the elements on the existing part of the profile with their contacts, the input of every solver.
* `laws`: force, stiffness and stored energy of each contact over its indentation.
* `inertia`: inertia forces on the orbiting elements.
"""
