"""The metrics of a design.

* `cost`: the cost class of its tolerances; `sweep`: the equilibrium of its virtual drives over rising twists;
  `response`: their mean curve, forces and pressure at the study's torque.
* `evaluate`: all metrics of given designs, and why a design has none.
"""
