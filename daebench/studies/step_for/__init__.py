"""Statistical test of a step size where single trajectories mean nothing: means and quantiles against those at half of the step."""
