"""Functions of a text as machine code, each in a module of its own."""

from itertools import count

from daebench.compiler.cache import generated
from daebench.compiler.written import written

_count = count()


def compiled(text, name="root"):
    """Return the function of this name in a text as machine code."""
    return getattr(generated("text", f"text {next(_count)} {text}", lambda: written("A text.", (name,), [text])), name)
