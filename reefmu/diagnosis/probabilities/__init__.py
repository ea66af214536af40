"""How probable each explanation of a record is, and what a record of its kind tells apart.

* `typical_sizes`: the scale of the effects' priors.
* `effect_columns`, `rival_hypotheses`, `predicted_isolability`: which effect would be named while another is true.
"""
