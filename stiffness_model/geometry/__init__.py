"""The path of the elements' centres and the gear profile that they roll on.

* `ball_path`: the nominal path, its equidistant, and where the profile intersects itself (paper, section II).
* `exact_profile`: nearest point, normal and curvature of the exact profile, instead of its linearisation.
* `seats`: how many elements fit on one eccentric, and the wall that remains between their bores.
"""
