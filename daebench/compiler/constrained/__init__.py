"""What follows from the definition of a constrained Hamiltonian system."""
