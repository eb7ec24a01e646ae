"""Tools for writing reports: numbers in words, tables, figures in a page, the page as one HTML file, and the gallery of all pages.

A report is a file with a docstring and a function ``make(out, progress)`` that writes ``out/index.html`` and returns its path. Those of
daebench are in ``daebench.reports``; one's own is built by its path::

    daebench report ./my_report.py
"""

from daebench.pages.report.citation import versions
from daebench.pages.report.claims import ClaimRefuted, require
from daebench.pages.report.gallery import build
from daebench.pages.report.page import Progress, make_page, write_page
from daebench.pages.report.pictures import inline_svg, picture
from daebench.pages.report.sentences import (
    MINUS,
    NONE,
    THIN,
    TIMES,
    at_least,
    at_most,
    count,
    listing,
    number,
    percent,
    power_of_ten,
    with_error,
)
from daebench.pages.report.tables import table

__all__ = [
    "MINUS",
    "NONE",
    "THIN",
    "TIMES",
    "ClaimRefuted",
    "Progress",
    "at_least",
    "at_most",
    "build",
    "count",
    "inline_svg",
    "listing",
    "make_page",
    "number",
    "percent",
    "picture",
    "power_of_ten",
    "require",
    "table",
    "versions",
    "with_error",
    "write_page",
]
