"""What a record of a kind tells apart, to first order in the effects.

* `effect_columns`: the traces of the effects along a record, whitened by the covariance of noise and scatter.
* `simulated_scores`: inner products of these traces with simulated records.
* `rival_hypotheses`: sets of effects, and how far their traces are from those of others.
* `amplitude_evidence`, `simulated_table`: the hypotheses' evidence by scores, and what the diagnosis would name.
* `predicted_isolability`: which effect would be named while another is true.
"""
