"""The extremes, one a file: what is run, what it says, and its picture."""
