"""JavaScript of a linked module: the same steps in a page, on nested tuples written out as variables, so that nothing is allocated.

A module is followed from its loop down, as Python would run it, with numbers that stand for variables of the script: tuples, constants and
calls are gone by then, and what no result depends on is left out.
"""
