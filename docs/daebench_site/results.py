"""The reports: pages of a gallery are put beside the site, and ``{report}`NAME``` is a link to one.

A gallery is a folder that ``daebench report all --out FOLDER`` wrote, given by ``-D gallery=FOLDER``, or the archive that is kept with
the sources.
"""

import shutil
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from docutils import nodes
from sphinx.util.docutils import SphinxRole

KEPT = Path(__file__).parents[2] / "reports" / "gallery" / "gallery.zip"


class ReportLink(SphinxRole):
    """A link to the page of a report or lesson."""

    def run(self) -> tuple[list[nodes.Node], list[Any]]:
        """Return the link."""
        depth = self.env.docname.count("/")
        words = self.text.removeprefix("lesson-") if self.text.startswith("lesson-") else f"Open the report {self.text}."
        return [nodes.reference("", words, refuri=f"{'../' * depth}reports/{self.text}/index.html")], []


def put_reports(app: Any, exception: Exception | None) -> None:
    """Put the pages of the reports beside those of the site."""
    if exception or app.builder.format != "html":
        return
    out = Path(app.outdir) / "reports"
    shutil.rmtree(out, ignore_errors=True)
    if app.config.gallery:
        shutil.copytree(app.config.gallery, out)
        return
    with ZipFile(KEPT) as archive:
        archive.extractall(out)


def setup(app: Any) -> None:
    """Add the role, and the copy at the end of a build."""
    app.add_config_value("gallery", "", "html")
    app.add_role("report", ReportLink())
    app.connect("build-finished", put_reports)
