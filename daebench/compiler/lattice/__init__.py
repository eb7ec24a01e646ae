"""What follows from the definition of a Poisson lattice."""
