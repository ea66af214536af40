"""Published gears to compare with: `gears` reads the rows of `catalog.toml`, each with its source."""
