"""Certificates: measurements of a code on some problems, with everything that is needed to repeat them."""
