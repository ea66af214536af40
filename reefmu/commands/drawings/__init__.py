"""Commands that take a drawing: `curve`, `compare`, `draw`; and `gears`, which lists those of makers.

* `population_run`: the virtual drives that a call asks for; `load_ratings`: pressures, losses and lives.
* `turning_individual`, `turning_files`: one virtual drive while it turns, for `curve --individual`.
"""
