"""The public things of the package as they stand in its source, without importing it: what the page has an entry for."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from daebench.errors import DaebenchError
from daebench.pages.api.contents import TASKS
from daebench.systems.files import package as package_files

if TYPE_CHECKING:
    from griffe import Alias, Module, Object

    Public = dict[str, Object]


class Undocumented(DaebenchError):
    """Something public that has no docstring."""


def package() -> "Module":
    """Return the source of the package as a tree."""
    import griffe

    place = package_files.folder("daebench")
    loader = griffe.GriffeLoader(search_paths=[place.parent], allow_inspection=False)
    tree = loader.load("daebench")
    if not isinstance(tree, griffe.Module):
        raise DaebenchError(f"the source of daebench is not in {place}; install it from its source.")
    for name in package_files.APART:
        if name not in tree.members:  # a checkout without symbolic links
            tree.set_member(name, loader.load(name))
    return tree


def public(tree: "Module") -> "dict[str, Public]":
    """Return the entries of each chapter by its key: what is described, by the dotted name to import it by.

    Raises
    ------
    Undocumented
        If something public has no docstring; the message names it.
    """
    chapters: dict[str, Public] = {}
    for task in TASKS:
        chapters[task.key] = {}
        for name in task.names:
            chapters[task.key] |= dict(_entries(name, _object(tree, name.partition(".")[2])))
    for path, definition in (pair for entries in chapters.values() for pair in entries.items()):
        _require_docstrings(path, definition)
    return chapters


def _object(of: "Object", name: str) -> "Object":
    from griffe import Object

    member: Object | Alias = of[name]
    return member if isinstance(member, Object) else member.final_target


def _entries(path: str, definition: "Object") -> "Iterator[tuple[str, Object]]":
    """Give a thing itself; of a module first itself, then what it exports, or else what is public in it and in its modules."""
    yield path, definition
    if not definition.is_module:
        return
    if definition.exports:
        yield from ((f"{path}.{name}", one) for name, one in _exported(definition) if one.docstring or not one.is_attribute)
        return
    for member in sorted(_own(definition), key=lambda member: member.name):
        if member.is_module:
            yield from _entries(f"{path}.{member.name}", member)
    for member in members(definition):
        yield f"{path}.{member.name}", member


def _exported(module: "Object") -> "Iterator[tuple[str, Object]]":
    """Give what a module exports; constants that are assigned several at once have no entry in the tree, and no docstring."""
    from griffe import AliasResolutionError

    for name in module.exports or ():
        try:
            yield str(name), _object(module, str(name))
        except AliasResolutionError:
            continue


def members(of: "Object") -> "list[Object]":
    """Return the public functions and classes of a module, or methods and properties of a class, and attributes that are described."""
    return [
        member
        for member in _own(of)
        if not member.is_module and (member.docstring or not member.is_attribute or "property" in member.labels)
    ]


def _own(of: "Object") -> "list[Object]":
    """Return what is defined in a module or class itself under a name that is not private."""
    from griffe import Object

    return [member for name, member in of.members.items() if isinstance(member, Object) and not name.startswith("_")]


def _require_docstrings(path: str, definition: "Object") -> None:
    for name, part in [(path, definition), *((f"{path}.{member.name}", member) for member in members(definition) if definition.is_class)]:
        if not part.docstring:
            raise Undocumented(f"{name} is public and has no docstring; write one, or give it a name that begins with an underscore.")
