"""Assertions about errors, in Python and of commands: their code and fields, not their sentence."""

import re
from contextlib import contextmanager

import pytest

from daebench.errors import BadInput


@contextmanager
def refused(code, kind=BadInput, says=(), **fields):
    """Assert that an error of a kind with this code is raised, with these fields among its own, which says these names and values.

    ``.value`` is the error.
    """
    with pytest.raises(kind) as caught:
        yield caught
    assert unsaid(says, caught.value) == [], caught.value
    assert (caught.value.code, caught.value.fields) == (code, caught.value.fields | fields), caught.value


def unsaid(names, error):
    """Return those of the names and values that an error does not say."""
    return [name for name in names if not re.search(rf"(?<!\w){re.escape(name)}(?!\w)", str(error))]


def require_refusals(daebench, command, *cases):
    """Require of a command that each of these options, as one types them, is refused with its code: in one line, with nothing printed."""
    for code, options in cases:
        status, out, err = daebench(*command, *options.split())
        told = getattr(daebench.error, "code", type(daebench.error).__name__)
        assert (told, status, out, err[:10], err.count("\n")) == (code, 2, "", "daebench: ", 1), (options, err)
