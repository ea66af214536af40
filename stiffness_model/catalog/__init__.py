"""Published gears for comparison: `gears` reads the rows of `catalog.toml`, each with its source."""
