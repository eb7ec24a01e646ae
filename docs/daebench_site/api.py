"""The reference of the Python interface: ``.. api:: KEY`` writes a chapter of :mod:`daebench_site.contents` from its docstrings."""

import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.pycode import ModuleAnalyzer
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

import daebench
from daebench_site.contents import TASKS

LOG = logging.getLogger(__name__)
CHAPTERS = {task.key: task for task in TASKS}

OTHERS = "choose-a-method"
"""Chapter of public functions and classes that no chapter names, such as those of a new study."""


def resolve(name: str) -> Any:
    """Return what a dotted name stands for."""
    module, _, attribute = name.rpartition(".")
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        return getattr(resolve(module), attribute)


def public_names(name: str) -> Iterator[str]:
    """Give the dotted names that a name of the contents stands for: itself, or of a module all that is public in it and in its modules."""
    thing = resolve(name)
    if not inspect.ismodule(thing):
        yield name
        return
    if hasattr(thing, "__all__"):
        described = ModuleAnalyzer.for_module(name).find_attr_docs()
        yield from (f"{name}.{member}" for member in thing.__all__ if callable(getattr(thing, member)) or ("", member) in described)
        return
    for module in sorted(_modules(thing)):
        yield from public_names(f"{name}.{module}")
    yield from (f"{name}.{member}" for member in _members(thing))


def _modules(package: Any) -> list[str]:
    from pkgutil import iter_modules

    return [module.name for module in iter_modules(getattr(package, "__path__", [])) if not module.name.startswith("_")]


def _members(module: Any) -> list[str]:
    """Return the public functions, classes and described constants that a module defines, in the order of its source."""
    analyzer = ModuleAnalyzer.for_module(module.__name__)
    described = {name for owner, name in analyzer.find_attr_docs() if not owner}
    own = {
        name
        for name, member in vars(module).items()
        if (inspect.isroutine(member) or inspect.isclass(member)) and getattr(member, "__module__", "") == module.__name__
    }
    return sorted((name for name in own | described if not name.startswith("_")), key=lambda name: analyzer.tagorder.get(name, 0))


@cache
def entries() -> dict[str, list[str]]:
    """Return the dotted names of all chapters; a thing that is named by itself is left out of the modules that have it too."""
    named = {id(resolve(name)): name for task in TASKS for name in task.names}
    chapters: dict[str, list[str]] = {}
    for task in TASKS:
        names = dict.fromkeys(name for part in task.names for name in public_names(part))
        kept = [name for name in names if named.setdefault(id(resolve(name)), name) == name or kind(name) == "autodata"]
        chapters[task.key] = sorted(kept, key=lambda name: name.count(".") > 1)  # those of daebench itself come first
    public = {name: getattr(daebench, name) for name in daebench.__all__}
    chapters[OTHERS] += [f"daebench.{name}" for name, thing in public.items() if id(thing) not in named and not inspect.ismodule(thing)]
    return chapters


def chapter_names(key: str) -> list[str]:
    """Return the dotted names of a chapter."""
    return entries()[key]


def summary(name: str) -> str:
    """Return the first sentence of a docstring."""
    text = inspect.getdoc(resolve(name)) or ""
    first = text.partition("\n\n")[0].replace("\n", " ")
    return first.removesuffix("::") + "." if first.endswith("::") else first


def kind(name: str) -> str:
    """Return the directive that describes a thing."""
    thing = resolve(name)
    if not getattr(thing, "__module__", "").startswith("daebench"):
        return "autodata"  # a constant, or another name of a type
    if inspect.isclass(thing):
        return "autoexception" if issubclass(thing, BaseException) else "autoclass"
    return "autofunction" if inspect.isroutine(thing) else "autodata"


class Api(SphinxDirective):
    """A chapter: what it is for, a table of its functions and classes, and an entry for each."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the nodes of the chapter."""
        key = self.arguments[0]
        names = chapter_names(key)
        lines = [*CHAPTERS[key].about.splitlines(), "", *self._table(names)]
        for name in names:
            lines += ["", f".. {kind(name)}:: {name}", *(["   :members:"] if kind(name) == "autoclass" else [])]
        for name in names:
            if kind(name) != "autodata":
                self.env.note_dependency(inspect.getsourcefile(inspect.unwrap(resolve(name))))
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)

    def _table(self, names: list[str]) -> list[str]:
        rows = [name for name in names if kind(name) != "autodata"]
        lines = [".. list-table::", "   :widths: 30 70", "   :class: api-summary", ""]
        for name in rows:
            role = "func" if kind(name) == "autofunction" else "class"
            lines += [f"   * - :{role}:`~{name}`", f"     - {summary(name)}"]
        return lines if rows else []


def unlink_words(app: Any, doctree: Any) -> None:
    """Take the links from words of the types of parameters, such as the n of ``shape(n,)``, which are no names of classes."""
    for node in list(doctree.findall(addnodes.pending_xref)):
        if node.get("refspecific") and not node["reftarget"].rpartition(".")[2][:1].isupper():
            node.replace_self(node.children)


def documented() -> dict[int, str]:
    """Return the documented names of things by their identity: a docstring may name a function by where it is defined."""
    return {id(resolve(name)): name for key in CHAPTERS for name in chapter_names(key)}


def find_by_identity(app: Any, env: Any, node: Any, content: Any) -> Any:
    """Resolve a reference by what it stands for; warn where one to daebench leads nowhere, and leave one to an internal name as text."""
    if node.get("refdomain") != "py":
        return None
    target, source = node["reftarget"].lstrip("~."), node.get("py:module") or ""
    if node["reftype"] == "mod" and target.startswith("daebench"):
        return _module_link(app, node, content, target)
    for name in (target, f"{source}.{target}"):
        full = _documented_name(env, name)
        if full:
            return env.domains["py"].resolve_xref(env, node["refdoc"], app.builder, "obj", full, node, content)
    if target.startswith("daebench."):
        if not _exists(target):
            LOG.warning("reference to %s leads nowhere", target, location=node, type="ref")
        return content
    return None


def _exists(name: str) -> bool:
    """Tell whether a dotted name stands for something, a member of a class among them."""
    try:
        resolve(name)
    except (AttributeError, ModuleNotFoundError, ValueError):
        owner, _, field = name.rpartition(".")
        try:
            return field in getattr(resolve(owner), "__annotations__", {})
        except (AttributeError, ModuleNotFoundError, ValueError):
            return False
    return True


def _documented_name(env: Any, name: str) -> str:
    if not name.startswith("daebench"):
        return ""
    if not hasattr(env, "daebench_documented"):
        env.daebench_documented = documented()
    head, attribute = name, ""
    for _ in range(2):
        try:
            known = env.daebench_documented.get(id(resolve(head)), "")
        except (AttributeError, ModuleNotFoundError, ValueError):
            known = ""
        if known:
            return f"{known}.{attribute}" if attribute else known
        head, _, attribute = head.rpartition(".")
    return ""


def _module_link(app: Any, node: Any, content: Any, target: str) -> Any:
    """Link a module to the chapter that has what is in it."""
    for key in CHAPTERS:
        if any(name.startswith(f"{target}.") for name in (*CHAPTERS[key].names, *chapter_names(key))):
            link = nodes.reference("", "", internal=True)
            link["refuri"] = app.builder.get_relative_uri(node["refdoc"], f"reference/api/{key}")
            link += content
            return link
    if not _exists(target):
        LOG.warning("there is no module %s", target, location=node, type="ref")
    return content


SILENT = "daebench.schemes.kernels."
"""Names of the scheme language, which are looked up on its page: H, p and q would be the answers to any search."""


def hide_language(app: Any, env: Any) -> list[str]:
    """Take the names of the scheme language out of the search; references to them still lead there."""
    objects = env.domains["py"].objects
    for name, entry in objects.items():
        if name.startswith(SILENT):
            objects[name] = entry._replace(aliased=True)
    return []


def name_defaults(app: Any, what: str, name: str, thing: Any, options: Any, signature: str, annotation: str) -> tuple[str, str] | None:
    """Name functions that are defaults, without their addresses."""
    return (re.sub(r"<function (\w+) at 0x\w+>", r"\1", signature), annotation) if signature else None


def setup(app: Any) -> None:
    """Add the directive, and what resolves references."""
    app.add_directive("api", Api)
    app.connect("autodoc-process-signature", name_defaults)
    app.connect("doctree-read", unlink_words)
    app.connect("env-updated", hide_language)
    app.connect("missing-reference", find_by_identity)
