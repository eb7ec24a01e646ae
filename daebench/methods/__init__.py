"""Methods: each a name with a step size or a tolerance, which turns an initial value problem into a trajectory."""
