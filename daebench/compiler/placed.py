"""Where in a scheme's file something is: its path, and the statement in which an error was raised."""

import linecache

from daebench.errors import InvalidProblem

PREFIX = "scheme:"
"""Beginning of the file name of compiled files of schemes."""


def placed(error: BaseException) -> InvalidProblem | None:
    """Return an error with file, line and expression of the innermost statement of a file in which it was raised; None if in none."""
    trace, innermost = error.__traceback__, None
    while trace:
        if trace.tb_frame.f_code.co_filename.startswith(PREFIX):
            innermost = trace
        trace = trace.tb_next
    if innermost is None:
        return None
    module = innermost.tb_frame.f_code.co_filename.removeprefix(PREFIX)
    positions = list(innermost.tb_frame.f_code.co_positions())[innermost.tb_lasti // 2]
    first, last, begin, end = (0 if x is None else x for x in positions)
    lines = linecache.getlines(f"{PREFIX}{module}")[first - 1 : last]
    lines[-1] = lines[-1][:end]
    text = " ".join(line.strip() for line in [lines[0][begin:], *lines[1:]])
    return InvalidProblem(f"{path_of(module)}, line {first}: {text}: {error}.")


def path_of(module: str) -> str:
    """Return the path of a file."""
    return f"{module.replace('.', '/')}.py"
