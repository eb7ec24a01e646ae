"""How references are stored, read and exported."""
