"""The gate for names in files: what an archive, a store, a certificate, a checkpoint or a reference names is foreign.

A name is classified by its text alone: nothing is imported, loaded, started or searched for. Only names of what comes with daebench pass.
Anything else has to be with the file that names it, and is executed only if it is trusted: all of it by a flag, or files whose contents are
those of files that were named in the command or the call.
"""

import hashlib
import re
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field
from pathlib import Path

from daebench.errors import BadInput
from daebench.methods.catalogue import own_problems
from daebench.methods.outside.read import PROGRAM
from daebench.systems.files.execute import existing, is_path

WORDS = re.compile(r"[A-Za-z0-9_]+([:+/@][A-Za-z0-9_]+)*")
"""Names of methods of daebench, see :mod:`daebench.methods.names`: words and the signs between them."""

TOLD = 3
"""Most names in a sentence."""

LONGEST = 60
"""Most characters of a name in a sentence."""


@dataclass(frozen=True)
class Trust:
    """Which code that files name may be executed."""

    everything: bool = False
    """Whether all of it may."""
    digests: frozenset[str] = frozenset()
    """SHA-256 of the contents of files that may."""

    @classmethod
    def of(cls, trust: bool, code: Iterable[str | Path] = ()) -> "Trust":
        """Return the trust that a command or a call expresses: in everything, or in the contents of these files, which are only read."""
        paths = [existing(str(file), "code", "ls") for file in code]
        return cls(trust, frozenset(hashlib.sha256(path.read_bytes()).hexdigest() for path in paths))


@dataclass(frozen=True)
class ForeignName:
    """A name of a problem or of a method in a file."""

    name: str
    """The name."""
    is_method: bool
    """Whether it is that of a method."""
    files: Mapping[str, str] = field(default_factory=dict)
    """Files with what is executed under this name, which are with the file that names it, and the SHA-256 of each."""
    whole: bool = True
    """Whether nothing but these files is executed, as a shell with a command in its arguments would be."""

    @property
    def is_own(self) -> bool:
        """Whether the text can only name something that comes with daebench, or nothing."""
        return is_own_method(self.name) if self.is_method else self.name in own_problems()

    def is_within(self, digests: Set[str]) -> bool:
        """Return whether all that is executed under this name are files with contents of these digests."""
        return bool(self.files) and self.whole and digests >= set(self.files.values())

    @property
    def is_place(self) -> bool:
        """Whether it names a file or a program, and not an installed package."""
        return self.is_method or is_path(self.name)


def is_own_method(name: str) -> bool:
    """Return whether a name can only be that of a method of daebench: no file, no library, and no program, within another name either."""
    # A text that has the form of a name may still start a program, if only behind a prefix; its form alone does not let it pass.
    return WORDS.fullmatch(name) is not None and PROGRAM.rstrip(":") not in re.split("[:+/@]", name)


def admit(place: str | Path, names: Iterable[ForeignName], trust: Trust) -> None:
    """Let the names in a file pass, or refuse the file before anything is executed."""
    # Own names bring no files, and a name may stand there several times: what lies beside trusted code could be imported by it.
    foreign = [name for name in names if not name.is_own or name.files]
    if lacking := [name for name in foreign if name.is_place and not name.files]:
        raise BadInput(f"{place} has runs of {_told(lacking)}, which is not in it; nothing is run.", "code-lacks-runs")
    if trust.everything:
        return
    if unknown := [name for name in foreign if not name.is_within(trust.digests)]:
        raise BadInput(
            f"{place} names code that does not come with daebench, {_told(unknown)}, which would be executed; "
            "read it, and add --trust, or name the same files by --code.",
            "code-not-trusted",
        )


def _told(names: Iterable[ForeignName]) -> str:
    texts = list(dict.fromkeys(_short(name) for name in names))
    return ", ".join(texts[:TOLD]) + (f" and {len(texts) - TOLD} more" if len(texts) > TOLD else "")


def _short(name: ForeignName) -> str:
    text = name.name if name.is_method or not name.files else Path(name.name).name
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
