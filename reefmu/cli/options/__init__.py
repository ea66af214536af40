"""Options of the commands: one module for each room of `reefmu.commands`."""
