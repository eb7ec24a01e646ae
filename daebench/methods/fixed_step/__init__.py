"""Fixed-step methods: a scheme on a form of the system, composed, projected, and linked to a problem."""
