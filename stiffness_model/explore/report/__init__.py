"""What a study found.

* `results`: feasibility, front and choice, and the designs as a table; `main_effects`: what each parameter does alone.
* `figures`: the front, the trade-off along it, the main effects; `chosen_drawing`: the chosen design as a drive.
"""
