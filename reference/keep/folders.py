"""Folders of references, those of daebench and the user's own, and the names that references may have."""

import os
import re
from pathlib import Path

from daebench.errors import BadInput

DATA = Path(__file__).parent.parent / "data"
"""Folder of the references that come with the package."""

NAME = re.compile(r"\w[\w.,+-]{0,150}", re.ASCII)
"""Pattern of names. A name becomes that of a folder and of a file, so it must not look like a path, a drive or an option."""


def own_folder() -> Path:
    """Return the folder of the user's own references: DAEBENCH_REFERENCES, or one in the platform's data folder of this user."""
    chosen = os.environ.get("DAEBENCH_REFERENCES")
    if chosen:
        return Path(chosen)
    import platformdirs

    return platformdirs.user_data_path("daebench") / "references"


def folders(folder: Path | None = None) -> tuple[Path, ...]:
    """Return the folders in which references are searched, in this order."""
    if folder is None:
        return (DATA, user_folder) if (user_folder := own_folder()).is_dir() else (DATA,)
    if not folder.is_dir():
        raise BadInput(f"{folder}: there is no such folder of references.")
    return (folder,)


def require_name(name: str) -> None:
    """Check that a reference may have a name."""
    if not NAME.fullmatch(name) or name.endswith("."):
        shown = ascii(name if len(name) <= 80 else f"{name[:77]}...")
        raise BadInput(f"{shown} is not a name of a reference, which is PROBLEM-CASE, of letters, digits and . , + - _ only, no path.")
