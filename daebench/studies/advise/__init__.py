"""Advice: which method, with which step size or tolerance, for an accuracy; what it costs, keeps, and what breaks first."""
