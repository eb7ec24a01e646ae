"""``daebench reference``: certified trajectories, one file per command."""

import typer

from daebench.cli.commands import Command
from daebench.cli.reference.at import at
from daebench.cli.reference.build import build
from daebench.cli.reference.compare import compare
from daebench.cli.reference.export import export
from daebench.cli.reference.listing import listing
from daebench.cli.reference.show import show
from daebench.cli.reference.verify import verify

app = typer.Typer(no_args_is_help=True, help="Certified reference trajectories: digits for your own tests.")
app.command("list", cls=Command)(listing)
for command in (show, at, verify, compare, export, build):
    app.command(cls=Command)(command)
