"""Assertions about commands that are refused: one line on standard error, nothing printed, and the code of the error."""


def require_refusals(daebench, command, *cases):
    """Require that a command is refused with each of these codes when the options that come with it are added, as one would type them."""
    for code, options in cases:
        status, out, err = daebench(*command, *options.split())
        told = getattr(daebench.error, "code", type(daebench.error).__name__)
        assert (told, status, out, err[:10], err.count("\n")) == (code, 2, "", "daebench: ", 1), (options, err)
