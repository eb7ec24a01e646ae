"""The schemes: one file each, a pure map with a hole (``kernels/hole.py``) and its claims."""
