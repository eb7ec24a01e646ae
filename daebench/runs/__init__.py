"""Initial value problems, requests, and the trajectories that result from them."""
