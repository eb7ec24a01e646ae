"""The gallery as one ZIP file for those who have no daebench: index, pages, and each file that a page links to."""

import math
import posixpath
import re
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from daebench.pages.report import build_stamp
from daebench.pages.report.index import LEAD
from daebench.runs.files import atomic

LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Time of every file in the archive, so that the same pages give the same bytes."""

BESIDE = re.compile(r'\s*<span class="beside">.*?</span>', re.DOTALL)
"""Text of a page on files beside it without a link, such as a store of runs: they are not in the archive."""

LINK = re.compile(r'<a\b[^>]*?href="(?![a-z]+:|#)([^"#]+)[^"]*"[^>]*>(.*?)</a>', re.DOTALL)
"""A link to another file."""


def write_archive(out: Path, path: Path, *, largest: float = math.inf) -> Path:
    """Write the pages of a gallery, its index, the pictures of that, and what pages link to into a ZIP file; return its path.

    The moving picture of the index is in it once more as a file, for an index that is written anew.
    """
    index = (out / "index.html").read_text(encoding="utf-8")
    pages = ["index.html", *sorted(f"{stamp.parent.name}/index.html" for stamp in out.glob(f"*/{build_stamp.STAMP}"))]
    texts: dict[str, str] = {}
    for page in pages:  # a page may lead to further ones, which are added to the list while it is gone through
        texts[page] = (out / page).read_text(encoding="utf-8")
        pages += [
            file
            for file in sorted(_linked(texts[page], page))
            if file.endswith(".html") and _fits(out / file, math.inf) and file not in pages
        ]
    files = {file for page, text in texts.items() for file in _linked(text, page) if _fits(out / file, largest)} - set(pages)
    files |= set(re.findall(r'<img\b[^>]*? src="([^":]+)"', index)) | {file.relative_to(out).as_posix() for file in out.glob(f"*/{LEAD}")}
    with atomic(path) as scratch, ZipFile(scratch, "w", ZIP_DEFLATED) as archive:
        for page in pages:
            _add(archive, page, _alone(texts[page], page, {*pages, *files}).encode())
        for file in sorted(files):
            _add(archive, file, (out / file).read_bytes())
    return path


def _fits(file: Path, largest: float) -> bool:
    """Return whether a file is there, and no larger than that."""
    return file.is_file() and file.stat().st_size <= largest


def _target(link: str, page: str) -> str:
    """Return the path in the gallery that a link of a page leads to."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), link))


def _linked(text: str, page: str) -> set[str]:
    """Return the paths of the files that a page links to, inside the gallery."""
    targets = {_target(link[1], page) for link in LINK.finditer(text)}
    return {target for target in targets if not target.startswith("..")}


def _alone(text: str, page: str, there: set[str]) -> str:
    """Return a page without text on files that are not in the archive; links to them become plain text."""

    def text_of(link: re.Match[str]) -> str:
        return link[0] if _target(link[1], page) in there else link[2]

    return LINK.sub(text_of, BESIDE.sub("", text))


def _add(archive: ZipFile, name: str, content: bytes) -> None:
    archive.writestr(ZipInfo(name, LONG_AGO), content, ZIP_DEFLATED, 9)
