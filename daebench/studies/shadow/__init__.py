"""Shadow Hamiltonians: the modified energy that a symplectic scheme conserves, computed along its orbit."""
