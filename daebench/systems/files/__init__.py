"""Problem files: found, read as text, and executed."""
