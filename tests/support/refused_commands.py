"""Assertions about commands that are refused: one line on standard error, nothing printed, and the code of the error."""


def require_refusals(daebench, words, cases):
    """Require that a command is refused with each of these codes when the options that come with it are given."""
    for code, *options in cases:
        status, out, err = daebench(*words, *options)
        assert (daebench.error.code, status, out, err[:10], err.count("\n")) == (code, 2, "", "daebench: ", 1), (options, err)
