"""Studies: grids of runs that are declared, computed once, kept, and read as one long table."""
