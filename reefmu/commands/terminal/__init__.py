"""What all commands share: drawings with overridden fields, notes, tables, JSON, worker processes."""
