"""Files: drawings in and out, and results that are written completely or not at all.

* `toml_files`: TOML texts of the package and of the user; `drawing_toml`: a drive of any kind from its TOML file and
  back; `ree_drawing`, `material_tables`: that of a rolling element eccentric drive; `drawing_format`: the documentation
  of its fields.
* `atomic_files`: temporary names that become files and folders when the work is done.
"""
