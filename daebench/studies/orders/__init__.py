"""The orders of methods, measured."""
