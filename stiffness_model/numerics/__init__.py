"""Numerical tools that know nothing of drives: roots of scalar functions, cubic B-splines on even nodes."""
