"""Declared distributions of the starts of an ensemble, one file a distribution."""
