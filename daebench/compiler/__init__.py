"""Compilation of a system's symbols and a scheme's file into one module."""
