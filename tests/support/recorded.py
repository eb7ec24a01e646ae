"""Functions of a text as machine code, or as Python that is printed from the same record, each in a module of its own."""

from daebench.compiler.cache import generated, written


def compiled(text, name="root", *, by_python=False):
    """Return the function of this name in a text."""
    executed = ["BY_PYTHON = True"] * by_python
    return getattr(generated("text", f"text {name} {by_python} {text}", lambda: written("A text.", (name,), [text], executed)), name)
