"""What a record of a kind tells apart, to first order in the effects.

* `effect_columns`: the traces of the effects along a record, whitened by the covariance of noise and scatter.
* `rival_hypotheses`: sets of effects, and how far their traces are from those of others.
* `predicted_isolability`: which effect would be named while another is true.
"""
