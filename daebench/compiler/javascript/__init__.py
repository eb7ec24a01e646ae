"""JavaScript of a linked module: the same steps in a page, with nested tuples written out as variables, so that no memory is allocated.

A module is followed from its loop down, as Python would run it, with numbers that stand for variables of the script. This removes tuples,
constants and calls. Statements on which no result depends are left out.
"""
