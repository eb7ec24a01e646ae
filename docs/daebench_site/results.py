"""The reports: pages of a gallery are put beside the site, ``reports/``, and linked from a card each.

A gallery is a folder that ``daebench report all --out FOLDER`` wrote, given by ``-D gallery=FOLDER``, or the archive that is kept with
the sources.
"""

import shutil
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

KEPT = Path(__file__).parents[2] / "reports" / "gallery"


def put_reports(app: Any, exception: Exception | None) -> None:
    """Put the pages of the reports beside those of the site."""
    if exception or app.builder.format != "html":
        return
    out = Path(app.outdir) / "reports"
    shutil.rmtree(out, ignore_errors=True)
    if app.config.gallery:
        shutil.copytree(app.config.gallery, out, ignore=shutil.ignore_patterns("reference"))
        return
    with ZipFile(KEPT / "gallery.zip") as archive:
        archive.extractall(out, [name for name in archive.namelist() if not name.startswith("reference/")])


class Reports(SphinxDirective):
    """A card for each report: its title, its picture, and the command that writes it."""

    def run(self) -> list[nodes.Node]:
        """Return the cards."""
        from daebench.methods.catalogue import lessons, reports

        lines = []
        for name, about in reports().items():
            lines += [f"`{name} <../reports/{name}/index.html>`__", f"   {about}", ""]
        lines += ["", ".. rubric:: Lessons", ""]
        for name, about in lessons().items():
            lines += [f"`{name} <../reports/lesson-{name}/index.html>`__", f"   {about}", ""]
        node = nodes.container()
        node.document = self.state.document
        self.state.nested_parse(StringList(lines, source="<reports>"), 0, node)
        return node.children


def setup(app: Any) -> None:
    """Add the directive and the copy at the end of a build."""
    app.add_config_value("gallery", "", "html")
    app.add_directive("reports", Reports)
    app.connect("build-finished", put_reports)
