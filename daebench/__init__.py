"""daebench."""
