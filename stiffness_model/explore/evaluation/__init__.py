"""The metrics of one design: `cost` from its drawing, `sweep` and `response` from its virtual drives at the torque.

* `evaluate`: all metrics of given designs, and why a design has none.
"""
