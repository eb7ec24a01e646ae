"""Quantities derived from the definition of a chain of bodies."""
