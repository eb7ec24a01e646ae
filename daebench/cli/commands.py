"""The class of all commands: the files that a command writes are its own, and others are replaced only with --overwrite."""

from typing import Any

import typer
from typer.core import TyperCommand


class Command(TyperCommand):
    """A command that, while it runs, is named as the writer of files, see :mod:`daebench.runs.outputs`."""

    def invoke(self, ctx: Any) -> Any:
        """Call the command."""
        from daebench.runs.outputs import writing

        with writing(_words(ctx), overwrite=bool(ctx.params.get("overwrite"))):
            return super().invoke(ctx)


def _words(ctx: typer.Context) -> str:
    """Return a command as it is called, for example "daebench reference export"."""
    words: list[str] = []
    while ctx.parent is not None:
        words.insert(0, str(ctx.info_name))
        ctx = ctx.parent  # type: ignore[assignment]
    return " ".join(["daebench", *words])
