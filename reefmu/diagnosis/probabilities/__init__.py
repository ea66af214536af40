"""How probable each explanation of a record is.

* `typical_sizes`: the scale of the effects' priors; `priors`: what a user knows of a drive.
* `marginal_likelihood`, `hypothesis_table`, `calibration`: from the fits to calibrated probabilities.
* `goodness_of_fit`: whether the chosen model explains the record.
* `decision`: the verdict that follows from the probabilities.
* `named_effects`: their parameters, with intervals that count the other explanations (`averaged_intervals`).
* `assessment`: all of it for one record.
"""
