"""Assertions about errors: their code and fields, not their sentence."""

from contextlib import contextmanager

import pytest

from daebench.errors import BadInput


@contextmanager
def refused(code, kind=BadInput, **fields):
    """Assert that an error of a kind with this code, and with these fields among its own, is raised; ``.value`` is the error."""
    with pytest.raises(kind) as caught:
        yield caught
    assert (caught.value.code, caught.value.fields) == (code, caught.value.fields | fields), caught.value
