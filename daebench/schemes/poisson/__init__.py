"""Schemes for Poisson systems: one file a scheme."""
