"""Records: numbers with what they were made of, their digests, and their comparison."""
