"""Measured quantities (drifts, defects, orders), as pure functions of numbers; one file for each."""
