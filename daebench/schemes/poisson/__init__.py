"""Schemes for Poisson systems: one file per scheme."""
