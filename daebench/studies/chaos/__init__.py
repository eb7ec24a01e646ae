"""Chaos over a plane of starts: the largest Lyapunov exponent and a fast indicator, by the tangent map of a scheme."""
