"""Studies: grids of runs that are declared, computed once, stored, and read as one long table."""
