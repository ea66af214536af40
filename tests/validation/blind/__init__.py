"""Blind cases: simulated measurements with hidden effects, on which the diagnosis is scored.

The generator shares no code with reefmu.effects or reefmu.model; of the project it uses stiffness_model alone.

    cases -> drawings, protocols, sizing -> elements, tables, contact_law -> plant -> sensors -> records

`forms` has the constitutive laws, `outside` discrepancies without a name. `records` makes a record from a case,
`outcome` and `scoring` judge the diagnosis of it.
"""
