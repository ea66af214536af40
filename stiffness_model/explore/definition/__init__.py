"""What a study varies, limits and optimises.

* `parameters`: fields of the drawing that vary, mapped onto the unit interval; `metrics`: what a design is measured by.
* `design`: from parameter values to the drive of a design; `study`: the study as a value; `study_toml`: from its file.
"""
