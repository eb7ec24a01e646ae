"""Storage, reading and export of references."""
