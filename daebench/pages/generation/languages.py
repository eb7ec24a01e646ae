"""The languages of generated code: how functions and numbers are written, and which files there are."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any

from daebench.compiler import in_python
from daebench.compiler.print import c, javascript, python
from daebench.compiler.syntax import text_of

if TYPE_CHECKING:
    from daebench.pages.generation.linked import Linked


def laid_out(text: str) -> str:
    """Return functions of C with one statement a line, and blocks indented."""
    lines: list[str] = []
    depth, within, line = 0, 0, ""

    def end() -> None:
        nonlocal line
        if line.strip():
            label = line.rstrip().endswith(":;")
            lines.append("    " * (depth - label) + line.strip())
        line = ""

    for letter in text:
        if letter == "{" and not line.rstrip().endswith("=") and not within:
            line += " {" if line.strip() and not line.endswith(" ") else "{"
            end()
            depth += 1
        elif letter == "}" and not within:
            end()
            depth -= 1
            line = "}"
            end()
        else:
            line += letter
            within += (letter in "({") - (letter in ")}")
            if letter == ";" and not within:
                end()
    end()
    return "\n".join(lines).replace("}\nelse {", "} else {").replace("\nstatic void", "\n\nstatic void") + "\n"


@dataclass(frozen=True)
class Language:
    """A language: how functions and numbers are written, and the files, of which the kernel has the name that is chosen.

    Functions have at most ``longest`` operations, unless that is 0; code that is ``readable`` has formulas and loops where it can.
    """

    functions: Callable[["Linked"], str]
    number: Callable[[float, str], str]
    files: tuple[str, ...]
    longest: int = 0
    readable: bool = False


def _one_by_one(language: Any, code: "Linked", *kind: str) -> str:
    """Return the functions, each behind those that it calls; ``kind`` is that of their numbers, where the language has several."""
    texts = []
    for part in (*code.problem, code.scheme):
        texts += [laid_out(language.instance(function, *kind)) for function in part.called]
        texts += [laid_out(language.function(function, parameters, *kind)) for function, parameters in part.functions.values()]
    return "\n".join(texts)


def _of_python(code: "Linked") -> str:
    """Return the functions, behind the constants that they share and what these are made by."""
    helpers = map(text_of, (in_python.whole, in_python.of_numpy, in_python.platform))
    functions = [[*part.called, *(function for function, _ in part.functions.values())] for part in (*code.problem, code.scheme)]
    return "\n\n\n".join([*helpers, python.text(list(chain.from_iterable(functions)))])


_OF_C = lambda code: _one_by_one(c, code, code.real), lambda x, kind: c.number(float(x), kind)
LANGUAGES = {
    "c": Language(
        *_OF_C, ("kernel.h", "kernel.c", "example.c", "check.c", "library.py", "Makefile", "CMakeLists.txt"), longest=10_000
    ),  # gcc takes 22 s for 10,800, and 7 s where they are divided
    "cpp": Language(*_OF_C, ("kernel.hpp", "example.cpp", "check.cpp", "Makefile", "CMakeLists.txt"), longest=10_000),
    "javascript": Language(
        partial(_one_by_one, javascript),
        lambda x, _: javascript.number(x),
        ("kernel.mjs", "kernel.d.ts", "check.mjs", "page.html"),
        longest=4000,  # V8 leaves functions of more than 60 kB of bytecode to its interpreter, which takes 20 times as long
    ),
    "python": Language(_of_python, lambda x, _: repr(x), ("kernel.py", "check.py"), readable=True),
}
"""Languages, by the names that they have here."""
