"""The mean drive as tables over twist and clearance, for models that run in real time.

* `build`: solves and holds the tables, with the band; `table`: one table; `stored`: reads tables that others may have
  written.
* `element_table`: one element's torque over twist, clearance and position; `modulus`: what softer contacts change.
"""
