"""Words for the languages that code is printed in: whole integrators, and the functions of a problem."""

from daebench.errors import BadInput

INTEGRATORS = ("c", "cpp", "javascript", "python")
FUNCTIONS = (*INTEGRATORS, "julia", "latex", "json")

_KEYWORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long register restrict return
short signed sizeof static struct switch typedef union unsigned void volatile while and bool catch class delete explicit export
false friend mutable namespace new not operator or private protected public template this throw true try typename using virtual
xor await debugger finally function import in instanceof let null super typeof var with yield
"""
KEYWORDS = frozenset(_KEYWORDS.split())
"""Keywords of C, C++ and JavaScript."""


def listed(languages: tuple[str, ...]) -> str:
    """Return languages as a list in words."""
    return f"{', '.join(languages[:-1])} or {languages[-1]}"


def unknown_language(language: str) -> BadInput:
    """Return the error for a language in which nothing is printed there."""
    return BadInput(
        f"there is no language {language!r}; choose {listed(INTEGRATORS)} for daebench generate, which writes integrators, "
        f"and {listed(FUNCTIONS)} for daebench show --as, which writes a problem's functions.",
        "unknown-language",
    )
