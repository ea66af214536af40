"""The drive as a chain of stages around the table of its contacts.

* `order`: which stages there are, what they read and write, and the order in which they run.
* `expressions`, `states`: the stages as CasADi expressions; `composition`: the model's functions, chained from them.
* `scalar`: the stages as functions in scalars, for generated C.
"""
