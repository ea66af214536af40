"""A drawing as values: one drive, the materials and tolerances of its parts, and the virtual drives sampled from it.

* `fields`: how a field of a drawing is declared; reader, writer, checks, studies and documentation follow from it.
* `materials`, `material_library`: elastic constants, and the materials that come with the package, with their sources.
* `tolerances`, `fits`: tolerance widths of ISO 286, 492 and 3290, and tolerance zones as a workshop writes them;
  `options`: what is switched on beyond the paper's contact model.
* `drive`: one drive, checked as a whole by `assembly_checks`; `twist_limits`: how far it may be twisted.
* `sampling`: the random deviations of virtual drives, in seeded blocks.
"""
