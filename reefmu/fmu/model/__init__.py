"""What an FMU computes and declares, whatever carries it.

* `component`, `joint`: signals, parameters and functions of the two kinds; `sizes`: their nominal sizes.
* `variables`: every variable declared once, with `units`; `kernel`: all of them on one array of doubles.
* `table_encoding`: the lookup as it stands in C sources.
"""
