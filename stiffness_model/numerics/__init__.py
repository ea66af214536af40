"""Numerical tools without reference to drives: the type of arrays, roots, cubic B-splines on uniform nodes."""
