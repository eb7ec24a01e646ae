"""Distributions of the starts of an ensemble."""
