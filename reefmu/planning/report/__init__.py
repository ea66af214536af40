"""What a plan writes: `protocol` (protocol.csv), `result` (plan.json), `figures` and `page` (plan.html), `files`."""
