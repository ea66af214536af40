"""The torque of the contacts as CasADi functions.

* `tables`: the lookup of a drawing, and its cache; `curve_contacts`: the lines of a curve without a
  drawing; `individual`: the contacts of one drive's own parts.
* `element`: the torque of one element, which may be missing; `equilibrium`: all of them in series with a compliance.
"""
