"""A lesson as a page that computes by itself: kernels in JavaScript, and what draws them, in one file that needs no server."""

import importlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from markupsafe import Markup

from daebench.methods.catalogue import lessons
from daebench.methods.fixed_step.script import Script
from daebench.pages.lesson.mathml import formula
from daebench.pages.report import write_page

PACKAGE = "daebench.reports.lessons"


@dataclass(frozen=True)
class Content:
    """What a lesson puts into its page.

    Parameters
    ----------
    scripts : mapping of str to Script
        Kernels by the name that the page has for them.
    functions : str
        Functions of the problem as a JavaScript object.
    data : mapping
        Numbers and names that the page's own script reads, as JSON takes them.
    text : mapping
        What the template of the page names.
    """

    scripts: Mapping[str, Script]
    functions: str = "{}"
    data: Mapping[str, Any] = field(default_factory=dict)
    text: Mapping[str, Any] = field(default_factory=dict)


def file_of(name: str) -> str:
    """Return the name of the files of a lesson's page, without their ends."""
    return f"_{name.replace('-', '_')}_page"


def lives_in_a_page(name: str) -> bool:
    """Return whether a lesson has a page that computes by itself."""
    return find_spec(f"{PACKAGE}.{file_of(name)}") is not None


def write(name: str, title: str, folder: Path) -> Path:
    """Write the page of a lesson into a folder, and return its path.

    Raises
    ------
    ClaimRefuted
        If a sentence of the page does not hold in this run.
    """
    module = importlib.import_module(f"{PACKAGE}.{file_of(name)}")
    content: Content = module.content()
    command, live = f"daebench lesson {name} --export DIR", f"daebench lesson {name}"
    parts = {"live_style": style(), "live_script": script_text(name, content), "body": body(name, content), "live": live}
    return write_page("live_lesson.html", folder / "index.html", command, title=title, under=lessons()[name], **parts)


def body(name: str, content: Content) -> Markup:
    """Return the screens of a page as HTML."""
    import jinja2

    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(text_of(PACKAGE, f"{file_of(name)}.html"))
    return Markup(template.render(tex=partial(tex), **content.text))


def tex(latex: str, display: bool = False) -> Markup:
    """Return a formula as MathML."""
    return Markup(formula(latex, display=display))


def style() -> Markup:
    """Return the style that such pages share."""
    return Markup(text_of("daebench.pages.lesson", "runtime.css"))


def script_text(name: str, content: Content) -> Markup:
    """Return the script of a page: kernels, numbers, what lessons share, and what this lesson draws."""
    kernels = ",".join(f"{json.dumps(key)}:{object_of(one)}" for key, one in content.scripts.items())
    data = json.dumps(content.data).replace("</", "<\\/")
    lines = [f"const DATA=Object.assign({data},{{methods:{{{kernels}}},functions:{content.functions}}});"]
    lines += [text_of("daebench.pages.lesson", "runtime.js"), text_of(PACKAGE, f"{file_of(name)}.js")]
    return Markup("\n".join(lines))


def object_of(script: Script) -> str:
    """Return a kernel with its numbers as a JavaScript object."""
    numbers = {"state": script.state, "par": script.par, "weights": script.weights, "directions": script.directions}
    return f"{{kernel:{script.text},{json.dumps(numbers)[1:]}"


def text_of(package: str, file: str) -> str:
    """Return the text of a file of a package."""
    return (resources.files(package) / file).read_text(encoding="utf-8")
