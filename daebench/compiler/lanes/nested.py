"""Functions of lanes in nested tuples, which hold states and reports; generated modules import all of them."""

from daebench.compiler.lanes import functions as _functions  # noqa: F401 - gives functions a meaning for lanes
from daebench.compiler.lanes.arrays import entry_of, length_of, mixed, put, put_all, take_all
from daebench.compiler.lanes.places import held, note, recall
from daebench.compiler.lanes.selection import absent, anyof, negated, select, spoiled
from daebench.compiler.lanes.shares import smallest_share

__all__ = [
    "absent",
    "anyof",
    "entry_of",
    "held",
    "length_of",
    "mixed",
    "negated",
    "note",
    "put",
    "put_all",
    "recall",
    "select",
    "smallest_share",
    "spoiled",
    "take_all",
]
