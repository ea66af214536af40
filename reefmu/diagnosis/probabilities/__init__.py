"""How probable each explanation of a record is, and what a record of its kind tells apart.

* `typical_sizes`: the scale of the effects' priors; `priors`: what a user knows of a drive.
* `marginal_likelihood`, `hypothesis_table`, `calibration`: from the fits to calibrated probabilities.
* `goodness_of_fit`: whether the chosen model explains the record.
* `effect_columns`, `rival_hypotheses`, `predicted_isolability`: which effect would be named while another is true.
* `assessment`: all of it for one record.
"""
