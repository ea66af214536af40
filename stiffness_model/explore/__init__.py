"""Design studies: parameters with ranges, limits and objectives, to a Pareto front and a chosen drawing."""
