"""What may be said: tests of the fitted sets, and the verdict.

* `isolability`, `thresholds`, `mean_drive`: what this excitation shows, what chance reaches, which drive it is.
* `population`, `single_drive`: what tolerances do by themselves; `nonparametric`, `model_comparison`: terms without a
  name against the named ones.
* `significance`, `verdict`: which effects are justified, and what is said of them.
"""
