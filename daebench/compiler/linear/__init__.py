"""Linear algebra of generated modules: tuples, arrays, and Gaussian elimination."""
