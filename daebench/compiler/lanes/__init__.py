"""Lanes for numba: W numbers in one vector of the processor, the same number of W runs at once.

Compiled for them, the functions of a linked module compute in each lane what they compute for float64, by the same operations in the same
order and so to the same bits. Where runs would take different branches, both are computed and the right values are selected.
"""
