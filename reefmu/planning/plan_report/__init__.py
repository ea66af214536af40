"""What a plan writes: `protocol_table` (protocol.csv), `result` (plan.json), `plan_page` with `plan_figures`
(plan.html). `plan_files` writes them all."""
