"""What the plain contact model leaves out, each part switched on by a field of the drawing (`options`).

Compliance of bodies (crank bearing, cage walls, ring, housing), the gear's true profile, conforming contact in the
cage's bores and the forces of inertia change the equilibrium; friction, pressure and rating life are read from it.
"""
