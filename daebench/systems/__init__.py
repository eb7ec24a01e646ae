"""Definitions of problems in the notation of the book, and how their files are found and read."""
