"""The contacts of every element: stiffness from radii and materials, for all elements of some virtual drives.

* `assembly`: the contacts at gear, crank and cage, ready for the equilibrium; `inertia`: forces of the elements' orbit.
* `laws`: force, stiffness and stored energy of each contact over its indentation.
"""
