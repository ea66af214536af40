"""C sources of a native FMU: `functions` (generated from the model), `sources` (with the wrapper), `compile`."""
