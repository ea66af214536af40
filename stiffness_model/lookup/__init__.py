"""The mean drive as tables over twist and clearance, for models that run in real time.

* `build_lookup`: solves the drawing over twist and clearance; `table`: the resulting spline tables;
  `curve_lookup`: a curve without a drawing, in their place.
* `element_table`: torque of one element over twist, clearance and position; `modulus`: the torque's dependence on
  Young's modulus.
* `table_files`: validation of tables read from files.
"""
