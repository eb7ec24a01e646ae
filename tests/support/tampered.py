"""Numbers of a report with one column altered, and altered references: what claims and checks are to catch."""

import json
from dataclasses import replace

from daebench.reference.keep import store


def changed(table, column, value, rows="index == index"):
    """Return a function that sets a column of a table of numbers to a value, in the rows of a query, or in all."""

    def tamper(numbers):
        frame = getattr(numbers, table)
        chosen = frame.index.isin(frame.query(rows).index)
        assert chosen.any()
        return replace(numbers, **{table: frame.assign(**{column: frame[column].where(~chosen, value)})})

    return tamper


def altered(name, folder, digits=None, certificate=None):
    """Change the digits, the certificate or both of a stored reference, with checksums redone."""
    old = store.load(name, folder)
    text = {name: list(column) for name, column in old.text.items()}
    claims = json.loads(json.dumps({key: value for key, value in old.certificate.items() if key not in ("data", "format", "checksum")}))
    if digits is not None:
        digits(text)
    if certificate is not None:
        certificate(claims)
    store.save(name, claims, text, folder)
