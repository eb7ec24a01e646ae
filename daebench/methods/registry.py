"""Registry of the schemes: every file of the folder, a scheme or a family of them."""

import importlib
from collections.abc import Mapping
from functools import cache

from daebench.schemes.kernels.claims import Member, PoissonClaims
from daebench.systems.files.package import folder

FOLDER = folder("daebench.schemes")


@cache
def registry() -> Mapping[str, tuple[str, Member]]:
    """Return the schemes by name, each with the name of its file and what tells it from others in there.

    A file has ``CLAIMS``, and is then one scheme of its own name, or ``MEMBERS``.
    """
    schemes: dict[str, tuple[str, Member]] = {}
    for path in sorted(FOLDER.glob("*.py")):
        if path.stem.startswith("_"):
            continue
        module = importlib.import_module(f"daebench.schemes.{path.stem}")
        members = getattr(module, "MEMBERS", None) or {path.stem: Member(claims=module.CLAIMS)}
        schemes |= {name: (path.stem, member) for name, member in members.items()}
    return schemes


@cache
def poisson_registry() -> Mapping[str, PoissonClaims]:
    """Return the claims of the schemes for Poisson systems by name, each that of a file."""
    names = sorted(path.stem for path in (FOLDER / "poisson").glob("*.py") if not path.stem.startswith("_"))
    return {name: importlib.import_module(f"daebench.schemes.poisson.{name}").CLAIMS for name in names}
