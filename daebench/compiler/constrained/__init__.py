"""Quantities derived from the definition of a constrained Hamiltonian system."""
