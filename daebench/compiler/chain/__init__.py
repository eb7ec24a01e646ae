"""What follows from the definition of a chain of bodies."""
