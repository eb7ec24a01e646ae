"""Arrays with one entry for each of several runs, in place of numbers: for functions that are not compiled."""
