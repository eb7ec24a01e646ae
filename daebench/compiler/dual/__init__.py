"""Dual numbers: a value and its derivatives in several directions. The derivatives are held in one vector register.

Functions of a linked module that are compiled for dual numbers compute the same values as for float64, by the same operations in the same
order and so to the bit. They compute the derivatives besides.
"""
