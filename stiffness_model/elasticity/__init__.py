"""Two elastic bodies pressed together: force and stiffness over indentation, pressure and size of the contact.

* `hertz`: point and line contacts of bodies that are flat beside their contact.
* `conformal`: a ball in a bore of nearly its own size, where Hertz's theory does not hold.
"""
