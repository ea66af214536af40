"""What is measured: `rig` (what a rig can do), `motion_pieces` (runs that it can make), `schedule` (set points of a
protocol, and the record that it would give)."""
