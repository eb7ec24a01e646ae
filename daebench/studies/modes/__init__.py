"""Small oscillations: the spectrum of each formulation at an equilibrium, and the natural frequencies with their shapes."""
