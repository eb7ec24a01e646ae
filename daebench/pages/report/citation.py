"""Citation of a page: version, commit and licence of daebench, and the versions of the packages that its numbers come from."""

import json
import subprocess
from importlib.metadata import PackageNotFoundError, distribution, metadata, version

from daebench.runs import provenance
from daebench.systems.files import package

AUTHORS = "The daebench founders"
"""As CITATION.cff has them, which is in no wheel; a test holds both against each other."""


def commit() -> str:
    """Return the commit that daebench is at, "with changes" where files differ from it; "" where it is not known."""
    folder = str(package.folder("daebench"))
    named = _git(folder, "rev-parse", "--short=12", "HEAD")
    # An installed package may be in a folder of another repository, whose commit says nothing of it.
    if not named or not _git(folder, "ls-files", "__init__.py"):
        return _installed()
    return f"{named} with changes" if _git(folder, "status", "--porcelain", "--untracked-files=no") else named


def _git(folder: str, *arguments: str) -> str:
    """Return the answer of Git on a folder; "" where there is no Git, or the folder is in no repository."""
    try:
        answer = subprocess.run(["git", "-C", folder, *arguments], capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""


def _installed() -> str:
    """Return the commit that an installation from a repository notes; "" where there is none."""
    try:
        noted = distribution("daebench").read_text("direct_url.json")
    except PackageNotFoundError:
        return ""
    return str(json.loads(noted or "{}").get("vcs_info", {}).get("commit_id", ""))[:12]


def licence() -> str:
    """Return the licence as the package's metadata name it."""
    return str(metadata("daebench")["License-Expression"])


def links() -> dict[str, str]:
    """Return the addresses of the project, such as its repository and documentation, as the package's metadata name them."""
    named = (entry.partition(",") for entry in metadata("daebench").get_all("Project-URL") or [])
    return {name.strip(): address.strip() for name, _, address in named}


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the numbers and pictures come from.

    Examples
    --------
    >>> "numpy" in versions()
    True
    """
    return provenance.versions() | {"matplotlib": version("matplotlib")}
