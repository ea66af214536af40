"""What a study found: `results` as a table, `main_effects` of the parameters, `figures`, and the `chosen_drawing`."""
