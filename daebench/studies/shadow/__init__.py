"""Shadow Hamiltonians: the energy that a symplectic scheme really keeps, computed along its orbit."""
