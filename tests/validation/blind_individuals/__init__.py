"""A blind catalogue of individuals: the examiner of the inference.

Every case is a drive with parts of its own, measured on a rig with faults of its own, in which effects are hidden at
sizes that drawings, materials and rigs make plausible. The drive is `stiffness_model.rotation`'s individual, extended
here by tolerances of position; what is hidden in it is written here and shares no code with `reefmu`. Whether the
truth can be told at all is decided by the Cramer-Rao bound of the generator's own responses.

    python -m tests.validation.blind_individuals --seed 1 --count 100 --out rows.jsonl
    python -m tests.validation.blind_individuals --score rows.jsonl

Rule: whoever changes the inference does not read this folder, and this folder is not changed after the inference has
been scored with it, but for names that a renaming elsewhere forces. A catalogue that is read is training data. What is
found wrong with it is written down, and corrected in the next catalogue.
"""
