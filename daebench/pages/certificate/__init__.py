"""Certificates as pages: one of a code, and a court of many."""
