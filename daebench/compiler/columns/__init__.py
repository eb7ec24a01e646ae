"""Arrays, with an entry for each of several runs, in the place of numbers: for functions that are not compiled."""
