"""Verification of references, and comparison of results with them."""
