"""Ensembles: one method on many starts, parameters or step sizes at once, and statistics of their results."""
