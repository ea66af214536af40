"""Pictures: curves of drives, and the drive itself to scale.

* `style`, `curves`, `profile`: pictures of results.
* `layout` (where every part stands), `loads` (under which forces), `outline`, `shapes` (what is drawn), `section`,
  `animation` and `dxf` (the files).
"""
