"""Pin-cycloid reducers: from the drawing to torque, forces and play of many virtual drives.

    pin_trochoid -> cycloidal_drive -> part_deviations -> discs -> gear_equilibrium -> cycloidal_population | gear_turn
    | cycloidal_lookup

* `pin_trochoid`: flank geometry; `cycloidal_drive`: the drawing, which `cycloidal_drawing` reads and writes.
* `part_deviations`: virtual drives; `discs`: contacts, stored energy and equilibrium of single discs.
* `gear_equilibrium`: the discs of a drive with its housing; `cycloidal_population`: `simulate`; `gear_turn`: one drive
  as it turns; `cycloidal_lookup`: tables for models.

docs/explanation/cycloidal.md states the equations, assumptions and sources.
"""
