"""What every page must be: one file that loads nothing, closes what it opens, and links to what is there."""

import re
from html.parser import HTMLParser

UNFILLED = ("{{", "{%", "&lt;sup", "&lt;math", "&lt;span")
LOADS = (r"<script[^>]+src", r"<link\b", r"@import", r"url\((?!#)", r"""\bsrc\s*=\s*["']?(?:https?:)?//""", r"\bfetch\(", "XMLHttpRequest")
VOID = ("meta", "link", "br", "img", "hr", "input")


class Page(HTMLParser):
    """What a page refers to, which names it has, its text, and whether its elements close."""

    def __init__(self, source):
        super().__init__()
        self.links, self.names, self.open, self.words = [], [], [], []
        self.feed(source)
        assert self.open == []

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag, attrs):
        self.links += [value for key, value in attrs if key in ("href", "src", "xlink:href", "data", "srcset", "action")]
        self.names += [value for key, value in attrs if key == "id" and tag != "clippath"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data):
        if not {"style", "svg", "script"} & set(self.open):
            self.words.append(data)


def standalone(path, *, quotes=False):
    """Return a page that stands alone, once that is sure: nothing is loaded, no name is there twice, no link leads nowhere.

    Nothing in it was left unfilled, and no number is missing; of a page that quotes code that cannot be asked.
    """
    source = path.read_text(encoding="utf-8")
    page = Page(source)
    for forbidden in LOADS:
        assert not re.search(forbidden, source), forbidden
    for forbidden in () if quotes else UNFILLED:
        assert forbidden not in source, forbidden
    assert len(page.names) == len(set(page.names))
    for link in page.links:
        if link.startswith("#"):
            assert link[1:] in page.names, link
        elif not link.startswith(("https://", "mailto:")):
            assert (path.parent / link.partition("#")[0]).is_file(), link
    assert quotes or not re.search(r"\b(nan|inf|None|True|False|Markup|undefined)\b", page.text)
    return page
