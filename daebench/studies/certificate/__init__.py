"""Certificates: a code measured on some problems, with all that is needed to measure it again."""
