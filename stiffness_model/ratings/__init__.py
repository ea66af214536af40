"""What the contact forces mean: pressures, static safety, rating life, losses.

* `pressure`: Hertzian pressures of standing drives; `peak_pressure`: the greatest over a turn.
* `static_safety` (ISO 76), `bearing_life` (ISO 281), `efficiency` (Coulomb friction).
"""
