"""Folders of references, those of daebench and the user's own, and names that a reference may have."""

import os
import re
from pathlib import Path

from daebench.errors import BadInput

DATA = Path(__file__).parent.parent / "data"
"""Where the references that come with the package are."""

NAME = re.compile(r"\w[\w.,+-]{0,150}", re.ASCII)
"""A name: it becomes that of a folder and of a file, so that nothing in it may be read as a path, a drive or an option."""


def own_folder() -> Path:
    """Return the folder of the user's own references: DAEBENCH_REFERENCES, or one in the platform's folder of data for this user."""
    chosen = os.environ.get("DAEBENCH_REFERENCES")
    if chosen:
        return Path(chosen)
    import platformdirs

    return platformdirs.user_data_path("daebench") / "references"


def folders(folder: Path | None = None) -> tuple[Path, ...]:
    """Return the folders in which references are looked for, the first before the second.

    Parameters
    ----------
    folder : Path, optional
        The only one; by default those that come with daebench and then the user's own, if there are some.

    Raises
    ------
    BadInput
        If the folder is not there.
    """
    if folder is None:
        return (DATA, user_folder) if (user_folder := own_folder()).is_dir() else (DATA,)
    if not folder.is_dir():
        raise BadInput(f"{folder}: there is no such folder of references.")
    return (folder,)


def require_name(name: str) -> None:
    """Go on if a reference may be called so.

    Raises
    ------
    BadInput
        If it may not.
    """
    if not NAME.fullmatch(name) or name.endswith("."):
        shown = ascii(name if len(name) <= 80 else f"{name[:77]}...")
        raise BadInput(f"{shown} is not a name of a reference: that is PROBLEM-CASE, of letters, digits and . , + - _ alone, and no path.")
