"""Lanes: W numbers in one vector register, for W runs at once.

Functions of a linked module that are compiled for lanes compute in each lane the same numbers as for float64, by the same operations in the
same order and so to the bit. If runs would take different branches, both branches are computed and the right values are selected.
"""
