"""Lessons: notebooks of marimo, one file each, beside the pure functions that compute and draw what they show."""
