"""The schemes: one file each, a pure map in the scheme language (``kernels/language.py``) and its claims."""
