"""Numbers of a report with one column altered: what its claims are to catch."""

from dataclasses import replace

import numpy as np


def changed(table, column, value, **where):
    """Return a function that sets a column of a table of numbers to a value, in the rows where other columns are as given."""

    def tamper(numbers):
        frame = getattr(numbers, table)
        chosen = np.ones(len(frame), dtype=bool)
        for name, wanted in where.items():
            chosen &= (frame[name] == wanted).to_numpy()
        assert chosen.any()
        return replace(numbers, **{table: frame.assign(**{column: frame[column].where(~chosen, value)})})

    return tamper
