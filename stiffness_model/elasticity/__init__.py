"""Contact of two elastic bodies: force and stiffness over the approach, pressure and size of the contact.

* `hertz`: point and line contacts that are small compared with the bodies.
* `conformal`: a ball in a bore of nearly its own size, where Hertz's theory does not hold.
"""
