"""Contact model of the stiffness of rolling element eccentric (REE) drives.

From a drawing to twist-over-torque, stiffness, backlash, contact forces and load shares of many virtual drives.
After Fritsch et al., "Static Modeling of the Stiffness and Contact Forces of Rolling Element Eccentric Drives
for Use in Robotic Drive Systems" (the paper; equation numbers are its).
"""
