"""Shell completion: names of problems, of their cases, and of methods."""

from collections.abc import Iterator

import typer


def problem_names(incomplete: str) -> list[str]:
    """Return the names of problems that begin with a text; the shell completes paths of files."""
    from daebench.methods import catalogue

    return [name for name in catalogue.problems() if name.startswith(incomplete)]


def case_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the cases of the given problem that begin with a text."""
    from daebench.compiler.definition import source_in
    from daebench.methods import catalogue

    words = [str(ctx.params.get("problem")), *ctx.args]  # missing options leave the arguments unread
    problem = next((catalogue.problems()[word] for word in words if word in catalogue.problems()), None)
    return [name for name in source_in(problem, {}).facts.CASES if name.startswith(incomplete)] if problem else []


def method_names(incomplete: str) -> list[str]:
    """Return the completions of the last name in a comma-separated list of methods, with the names before it."""
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in _methods() if name.startswith(last)]


def _methods() -> Iterator[str]:
    from daebench.methods.names_tables import CONSTRAINED, POISSON

    yield from sorted({method.name for table in (CONSTRAINED, POISSON) for method in table.listed()})
