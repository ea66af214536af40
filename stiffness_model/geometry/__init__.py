"""The path of the elements' centres and the gear profile that they roll on.

* `ball_path`: the nominal path, its equidistant, where the profile cuts itself (paper, section II).
* `exact_profile`: nearest point, normal and curvature of the true profile, instead of its linearisation.
* `seats`: how many elements fit on one eccentric, and the wall that they leave between their bores.
"""
