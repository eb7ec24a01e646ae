"""``daebench open``: the gallery, the documentation or the page of a problem, in the browser."""

from pathlib import Path
from typing import Annotated
from zipfile import ZipFile

import typer

from daebench.cli.arguments import Json
from daebench.cli.completion import problem_names
from daebench.cli.console import print_json
from daebench.compiler.cache import cache_directory
from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.records.seals import sha256
from daebench.runs.files import atomic_folder
from daebench.systems.files.package import folder

INDEX = "index.html"

Browser = Annotated[bool, typer.Option("--browser/--no-browser", help="Whether the page is opened in the browser.")]


def opening(
    page: Annotated[
        str, typer.Argument(help="gallery, docs, or a problem: its name or the path of its file.", autocompletion=problem_names)
    ],
    pages: Annotated[Path, typer.Option("--in", help="Folder of the pages that you have written.")] = Path("output"),
    browser: Browser = True,
    as_json: Json = False,
) -> None:
    """Open the gallery, the documentation, or the page of a problem in the browser, and print where it is."""
    if page == "docs":
        address = _documentation(pages).resolve().as_uri()
    elif page == "gallery":
        address = (_gallery(pages) / INDEX).resolve().as_uri()
    else:
        address = _page_of(page, pages)
    if as_json:
        print_json({"page": address})
        return
    print(address)
    if browser:
        show(address)


def show(address: str) -> None:
    """Open an address in the browser."""
    import webbrowser

    webbrowser.open(address)


def _gallery(out: Path) -> Path:
    """Return a gallery: the one in the folder, or the one that comes with the sources, unpacked."""
    if (out / INDEX).is_file():
        return out
    archived = folder("daebench.reports") / "gallery" / "gallery.zip"
    if not archived.is_file():
        raise BadInput(
            f"there is no gallery in {out}; daebench report all --out {out} writes it, daebench report methods --out {out} a part.",
            "no-gallery",
        )
    unpacked = cache_directory() / f"gallery-{sha256(archived.read_bytes())[:12]}"
    if not unpacked.is_dir():
        with atomic_folder(unpacked) as scratch, ZipFile(archived) as archive:
            archive.extractall(scratch)
    return unpacked


def _documentation(out: Path) -> Path:
    """Return the first page of the documentation, where it has been built."""
    page = out / "docs" / INDEX
    if not page.is_file():
        raise BadInput(
            f"there is no documentation in {page.parent}; in the sources of daebench, python -m sphinx docs {page.parent} builds it.",
            "no-documentation-built",
        )
    return page


def _page_of(name: str, out: Path) -> str:
    """Return the address of the page of a problem: in the gallery, or the lesson on it."""
    problem = find_problem(name)
    lesson = out / f"lesson-why-symplectic-{problem.path.stem.replace('_', '-')}" / INDEX
    if lesson.is_file():
        return lesson.resolve().as_uri()
    if problem.package != "daebench":
        raise BadInput(
            f"there is no page of {name} in {out}; daebench lesson why-symplectic --problem {name} --export {out} writes one.",
            "no-lesson-page",
        )
    page = _gallery(out) / "problems" / f"{problem.name}.html"
    if page.is_file():
        return page.resolve().as_uri()
    if not page.with_name(INDEX).is_file():
        raise BadInput(f"there is no page of {name} in {out}; daebench report problems --out {out} writes it.", "no-problem-page")
    return f"{page.with_name(INDEX).resolve().as_uri()}#{problem.name}"
