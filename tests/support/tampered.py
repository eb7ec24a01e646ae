"""Numbers of a report with one column altered, and altered references: what claims and checks are to catch."""

import json
from dataclasses import replace
from decimal import Decimal, localcontext

from daebench.reference.check.verify import verify
from daebench.reference.keep import store


def changed(table, column, value, rows=""):
    """Return a function that sets a column of a table of numbers to a value, in the rows of a query, or in all."""

    def tamper(numbers):
        frame = getattr(numbers, table)
        chosen = frame.index.isin(frame.query(rows).index if rows else frame.index)
        assert chosen.any()
        return replace(numbers, **{table: frame.assign(**{column: frame[column].where(~chosen, value)})})

    return tamper


def content_of(reference):
    """Return what a certificate says besides what is written with it: all that a reference is stored with."""
    return json.loads(
        json.dumps({key: value for key, value in reference.certificate.items() if key not in ("data", "format", "name", "checksum")})
    )


def altered(name, folder, digits=None, certificate=None):
    """Change the digits, the certificate or both of a stored reference, with checksums redone."""
    old = store.load(name, folder)
    text, claims = {name: list(column) for name, column in old.text.items()}, content_of(old)
    if digits is not None:
        digits(text)
    if certificate is not None:
        certificate(claims)
    store.save(name, claims, text, folder)


def nudged(column, by, row):
    """Return an alteration that adds a decimal number to one number of a reference."""

    def change(text):
        with localcontext(prec=50):
            text[column][row] = str(Decimal(text[column][row]) + Decimal(by))

    return change


def failing(name, folder):
    """Return what fails of a reference, as one text."""
    return "; ".join(check.what for check in verify(name, folder).checks if not check.ok)
