"""The commands of the command line: one module each, with `run(args) -> int`, the exit status."""
