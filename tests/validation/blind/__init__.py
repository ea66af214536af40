"""Measured records in which effects are hidden: the examiner of the diagnosis.

Shares no code with reefmu.effects or reefmu.model; of the project it uses stiffness_model alone.
"""
