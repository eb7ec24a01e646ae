"""Quantities derived from the definition of a Poisson lattice."""
