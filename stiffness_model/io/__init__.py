"""Files: drawings in and out, and results that are written completely or not at all.

* `toml_files`: TOML texts of the package and of the user; `material_tables`, `drawing_toml`: a drawing from its TOML
  file and back; `drawing_format`: the documentation of its fields.
* `atomic_files`: temporary names that become files and folders when the work is done.
"""
