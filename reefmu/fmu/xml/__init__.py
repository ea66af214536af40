"""The XML of an FMU and the archive.

`description` holds what both versions of FMI have in common, `fmi2` and `fmi3` the rest; `archive` reads and writes the
zip file.
"""
