"""Attacks: programs that try many hostile inputs, calls and kills, and print every case that does not end well.

Each has `--seed` and `--count`; `test_fuzz.py` runs a few cases of each.
"""
