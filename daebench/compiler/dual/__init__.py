"""Dual numbers for numba: a value and its derivatives in several directions, the latter in one vector of the processor.

Compiled for them, the functions of a linked module compute what they compute for float64, by the same operations in the same order and so
to the same bits, and its derivative beside it.
"""
