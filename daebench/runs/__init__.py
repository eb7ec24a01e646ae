"""An initial value problem, what is asked of it, and the trajectory that comes out."""
