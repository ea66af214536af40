"""Files: drawings in TOML (`drawing_toml`), and files that are written whole or not at all (`atomic_files`)."""
