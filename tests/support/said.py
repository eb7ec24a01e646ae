"""What a reader of the README and of the documentation has and does: their files and commands, and what daebench says when it says no.

Run as a script, it rewrites the sentences of the page of messages that are not those of the commands any more.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
DOCS = ROOT / "docs"
MESSAGES = DOCS / "how-to" / "messages.md"

FENCE = r"^```{code-block} %s\n:(?:caption|name): %s\n\n(.*?)^```"
"""A block of code with a name: a file, or commands that make files."""


@dataclass(frozen=True)
class Trouble:
    """A command with the cache directory it names, if any, and what it is said to say."""

    words: tuple[str, ...]
    message: str
    cache: str = ""

    def is_said_in(self, message):
        """Return whether the page has a message, in which three dots stand for some digits."""
        return re.fullmatch(re.escape(self.message).replace(r"\.\.\.", r"\S+?"), message) is not None


class Rewriting:
    """Puts what a command says in the place of the sentence on the page, where the test of the page finds that they differ."""

    def pytest_runtest_logreport(self, report):
        for sentence, message in report.user_properties if report.when == "call" else []:
            MESSAGES.write_text(MESSAGES.read_text(encoding="utf-8").replace(f"\n: `{sentence}`\n", f"\n: `{message}`\n"), encoding="utf-8")


def pages():
    """Return the README and all pages of the documentation, in the order in which their commands can be called one after another."""
    listed = [
        DOCS / "how-to" / f"{name}.md" for name in re.findall(r"^([\w-]+)$", (DOCS / "how-to" / "index.md").read_text(), re.MULTILINE)
    ]
    others = sorted(path for path in DOCS.rglob("*.md") if path not in listed)
    return [README, *(path for path in listed if path.is_file()), *others]


@cache
def text_of_all():
    """Return the text of all pages."""
    return "\n\n".join(page.read_text(encoding="utf-8") for page in pages())


def blocks(language):
    """Return the blocks of code of all pages in a language, but for those below a marker and those that have a name."""
    text = text_of_all()
    return list(dict.fromkeys(re.findall(rf"(?<!-->\n)^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)))


def block(name, language=""):
    """Return the block of code that has a name."""
    language = language or ("xml" if name.endswith(".xml") else "python")
    return re.search(FENCE % (language, re.escape(name)), text_of_all(), re.MULTILINE | re.DOTALL)[1]


def files():
    """Return the names of the files that the pages show whole."""
    fences = (FENCE % ("python", r"(\w+\.py)"), FENCE % ("xml", r"(\w+\.xml)"))
    return [name for fence in fences for name, _ in re.findall(fence, text_of_all(), re.MULTILINE | re.DOTALL)]


def troubles():
    """Return the messages of the page of messages."""
    text = MESSAGES.read_text(encoding="utf-8")
    rows = re.findall(r"^`(?:DAEBENCH_CACHE=(\S+) )?daebench ([^`\n]*)`\n: `([^`\n]*)`$", text, re.MULTILINE)
    return [Trouble(tuple(shlex.split(command)), message, cache) for cache, command, message in rows]


def commands():
    """Return the commands of all pages, in their order, each once."""
    lines = [line for text in blocks("sh") for line in text.replace("\\\n", " ").splitlines()]
    return list(dict.fromkeys(" ".join(line.split()) for line in lines if line.strip()))


def printed_by(command):
    """Return what the pages show that a command or program prints, None where they show nothing."""
    shown = re.search(rf"^{re.escape(command.rstrip())}\n```\n\n```text\n(.*?)^```", text_of_all(), re.MULTILINE | re.DOTALL)
    return shown and shown[1]


def programs():
    """Return the Python programs of all pages, but for those that are files."""
    return blocks("python")


def write_files(folder):
    """Write the files that the pages show, and make the others as they say."""
    shutil.copytree(_written().name, folder, dirs_exist_ok=True)


@cache
def _written():
    kept = tempfile.TemporaryDirectory()
    for name in files():
        Path(kept.name, name).write_text(block(name), encoding="utf-8")
    call(block("mistakes", "sh"), Path(kept.name))
    return kept


def call(command, folder):
    """Return the completed call of a command line in a folder, with daebench and python those of the tests."""
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    for name, what in (("daebench", "-m daebench"), ("python", "")):
        tool = tools / name
        tool.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {what} "$@"\n', encoding="utf-8")
        tool.chmod(0o755)
    source = str(ROOT)
    path = {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": source}
    return subprocess.run(["sh", "-ec", command], cwd=folder, env=os.environ | path, capture_output=True, text=True, check=False)


if __name__ == "__main__":
    pytest.main(["-q", str(ROOT / "tests" / "cli" / "test_readme.py"), "-k", "message_of_the_documentation"], plugins=[Rewriting()])
