"""Advice: the method and its step size or tolerance for an accuracy, with its cost, conserved quantities and sensitivity to changes."""
