"""Gears as their makers describe them: rows for comparison, and drives of kind "catalogue".

* `gears`: the rows of `catalog.toml`, each with its source.
* `catalogue_drive`: a gear's data sheet as a drive; `efficiency_table`: its efficiency over speed and load;
  `catalogue_toml`: both from TOML and from the rows, and back.
* `catalogue_population`: its population, curve, lookup and inherent effects.
"""
