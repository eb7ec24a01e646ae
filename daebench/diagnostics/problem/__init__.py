"""A problem file held against its own equations."""
