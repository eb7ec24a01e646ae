"""What a problem is, as the book writes it, and how its file is found and read."""
