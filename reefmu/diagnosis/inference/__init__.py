"""What tests of significance conclude from the fitted sets of effects.

* `mean_drive`, `isolability`, `thresholds`: which drive it is, what this excitation shows, which gains chance reaches.
* `individual_drive`: what an individual of the population shows without any effect.
* `evidence`: what a verdict is drawn from, and what a fit leaves unexplained.
* `significance`: which sets of effects are significant; `nonparametric`, `model_comparison`: named effects compared
  with terms without a name.
* `alternatives`, `verdict`: what else is possible, and the conclusion, which `probabilities` confirms or changes.
"""
