"""Tables that commands write to a folder, each with a text beside it that says how it was made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Folder:
    """The folder of --out, if it is given, and the tables that a command writes there.

    Parameters
    ----------
    out : Path, optional
        The folder.
    command : str
        The command, as the texts beside its tables name it.
    tables : sequence of str
        Names of the tables.
    """

    out: Path | None
    command: str
    tables: Sequence[str]

    def check(self, *, overwrite: bool) -> None:
        """Refuse, before the runs, a folder that cannot be written to, and tables of other commands."""
        from daebench.runs import provenance
        from daebench.runs.files import make_folder

        if self.out is None:
            return
        make_folder(self.out)
        for name in self.tables:
            provenance.require_own(self.out / name, self.command, overwrite=overwrite)

    def described(self, ivp: Any, about: Mapping[str, str], picture: Path) -> list[str]:
        """Write how each table was made into a text beside it; return the paths of tables and picture."""
        from daebench.runs import provenance

        assert self.out is not None
        paths = [self.out / name for name in self.tables]
        for path in paths:
            provenance.write_beside(path, provenance.made_by(self.command) | provenance.definition(ivp) | dict(about))
        return list(map(str, (*paths, picture)))
