"""Ratings from the contact forces: pressures, static safety, bearing life, friction losses.

* `pressure`: Hertzian pressures of drives at random angles; `peak_pressure`: their maximum over a turn of the output.
* `static_safety` (ISO 76), `bearing_life` (ISO 281), `efficiency` (Coulomb friction).
"""
