"""The dictionary of faults: a description of each, and its remedy; they are the rows of ``faults.csv``."""

import csv
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Fault:
    """A known fault.

    Parameters
    ----------
    about : str
        Behaviour of a code with the fault, as the end of "the code ...".
    remedy : str
        What to change, as a sentence.
    """

    about: str
    remedy: str


with Path(__file__).with_name("faults.csv").open(encoding="utf-8", newline="") as rows:
    FAULTS = {row["fault"]: Fault(row["about"], row["remedy"]) for row in csv.DictReader(rows)}
"""The faults by their names; each is relative to RATTLE, HLW (1.26)."""
