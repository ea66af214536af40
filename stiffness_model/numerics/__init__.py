"""Numerical tools that know nothing of drives: the type of arrays, roots of functions, cubic B-splines on even nodes."""
