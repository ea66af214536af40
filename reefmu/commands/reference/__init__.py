"""Commands that list what comes with the package: `effects`, `materials`, `gears`."""
