"""Several methods on one initial value problem, side by side."""
