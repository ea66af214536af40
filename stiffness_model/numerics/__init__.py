"""Numerical tools that know nothing of drives: the type of arrays, roots, cubic B-splines on even nodes."""
