"""Statistical test of a step size for chaotic motions: means and quantiles are compared with those at half of the step."""
