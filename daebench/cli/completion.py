"""What a shell completes: names of problems, of their cases, and of methods."""

from collections.abc import Iterator

import typer


def problem_names(incomplete: str) -> list[str]:
    """Return the names of problems that begin so; a path of a file is completed by the shell."""
    from daebench.methods import catalogue

    return [name for name in catalogue.problems() if name.startswith(incomplete)]


def case_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the cases of the problem that was given which begin so."""
    from daebench.compiler.definition import source_in
    from daebench.methods import catalogue

    words = [str(ctx.params.get("problem")), *ctx.args]  # options that are missing yet leave the arguments unread
    problem = next((catalogue.problems()[word] for word in words if word in catalogue.problems()), None)
    return [name for name in source_in(problem, {}).facts.CASES if name.startswith(incomplete)] if problem else []


def method_names(incomplete: str) -> list[str]:
    """Return the names of methods that the last of a list, separated by commas, begins, with those before it."""
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in _methods() if name.startswith(last)]


def _methods() -> Iterator[str]:
    from daebench.methods.names_tables import CONSTRAINED, POISSON

    yield from sorted({method.name for table in (CONSTRAINED, POISSON) for method in table.listed()})
