"""Grids of runs: declared, computed once, stored, and read as one long table."""
