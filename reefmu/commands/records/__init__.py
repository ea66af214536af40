"""Commands that take measured records: `diagnose`, `record`."""
