"""Places of the package's own files: in a wheel, in a checkout with symbolic links, and in one without them."""

import hashlib
from collections.abc import Iterable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

APART = ("problems", "reference", "reports")
"""Packages inside daebench whose folders are beside it in a checkout."""


@cache
def folder(package: str) -> Path:
    """Return the folder of a package such as ``daebench.problems``. It is not imported, but its parent packages are."""
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"there is no package {package}; reinstall daebench.", name=package)
    return Path(next(iter(spec.submodule_search_locations)))


@cache
def text_of(module: str) -> str:
    """Return the source of a module of daebench, which is read but not imported."""
    return folder("daebench").joinpath(*module.split(".")[1:]).with_suffix(".py").read_text(encoding="utf-8")


@cache
def digest_of_packages(*names: str) -> str:
    """Return the hash of the names and contents of all Python files in packages of daebench, including subfolders."""
    package = folder("daebench")
    sources = sorted(file for name in names for file in (package / name).rglob("*.py"))
    return digest_of_files((file.relative_to(package).as_posix(), file.read_bytes()) for file in sources)


def digest_of_files(files: Iterable[tuple[str, bytes]], head: str = "") -> str:
    """Return the hash of a text and of the contents of files, each with the name under which it is hashed."""
    digest = hashlib.sha256(head.encode())
    for name, content in files:
        # With the length, so that contents cannot move from one file to the next under the same hash.
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def files(*endings: str) -> dict[str, Path]:
    """Return the files with one of these extensions by their paths in the package, which do not depend on the places of its folders."""
    places = {Path(): folder("daebench"), **{Path(name): folder(f"daebench.{name}") for name in APART}}
    return {
        (inside / path.relative_to(place)).as_posix(): path
        for inside, place in places.items()
        for path in sorted(place.rglob("*"))
        if path.suffix in endings and path.is_file()
    }
