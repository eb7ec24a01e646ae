"""Checkpoints of long runs, alone and in lanes: one file for each, replaced as a whole, from which a run goes on to the same bits."""

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.records.code import code_version
from daebench.records.seals import digest, words
from daebench.runs.files import atomic
from daebench.runs.json_values import strict
from daebench.runs.schema import SHOWN, Fields, Flag, Items, Named, Text, Whole, shown
from daebench.runs.trajectory import Array
from daebench.runs.zipped import UNREADABLE, arrays_in
from daebench.studies.grid.run_specification import defined_by
from daebench.studies.long.lanes import LaneStream
from daebench.studies.long.run import Checkpoint, LongRun, Stream
from daebench.studies.long.windows import COUNT, EDGES, Blocks, Windows

LAYOUT = 5
"""Version of the layout of the file: an archive of NumPy, and a digest of it."""

SEAL = hashlib.sha256().digest_size
"""Bytes of that digest; what reads archives of NumPy passes over it."""


class _Plain:
    """Anything that JSON has: it is compared, and nothing is made of it."""

    def read(self, value: Any, place: str) -> Any:
        """Return the value."""
        return value


def identity(spec: LongRun) -> dict[str, Any]:
    """Return all that decides the numbers of a run: its fields, its definition with its numbers, its code, and all versions."""
    code = {"code": spec.code} if spec.code else {}
    return {**spec.plain(), **code, "definition": digest(*defined_by(spec.ivp)), "versions": code_version()}


def group_identity(spec: LongRun) -> dict[str, Any]:
    """Return the same of the members of an ensemble in lanes, whichever these are."""
    return {name: value for name, value in identity(spec.member_of(0)).items() if name != "member"} | {"in": "lanes"}


def save(path: Path, who: dict[str, Any], stream: Stream | LaneStream) -> None:
    """Write a run, or the members that are in lanes, as they are, whole or not at all."""
    left, blocks = stream.checkpoint(), stream.blocks
    kind = {"rank_pending": left.rank_pending} if left.members is None else {"members": list(left.members)}
    about = {"who": who, "counts": [left.done, left.left, left.passages, blocks.length, blocks.pieces], "failure": left.failure, **kind}
    arrays = {
        "reals": np.concatenate([[left.seconds], np.ravel(blocks.total), np.ravel(left.first)]),
        "windows": left.windows.table,
        "means": blocks.means,
        "numbers": left.numbers,
        "waiting": left.waiting,
    }
    content = io.BytesIO()
    named: dict[str, Any] = {"about": np.array(json.dumps({"layout": LAYOUT, **about})), **arrays}
    np.savez(content, **named)
    with atomic(path) as scratch:
        scratch.write_bytes(content.getvalue() + _seal(content.getvalue()))


def load(path: Path, who: dict[str, Any]) -> Checkpoint:
    """Return a run, or members in lanes, as left; raise BadInput if the file is damaged, or of another run, definition, or version."""
    about, arrays = _read(path)
    _require_same(path, about, who)
    members, n = None, 1
    if "members" in about:
        members = tuple(about["members"])
        n = len(members)
    several = () if members is None else (n,)
    shapes = {"windows": (*several, None, COLUMNS), "means": (*several, None), "numbers": (None, *several), "waiting": (None, *several)}
    _require_shapes(path, arrays, {"reals": (1 + 2 * n,), **shapes})
    done, left, passages, length, pieces = about["counts"]
    seconds, *statistics = np.split(arrays["reals"], [1, 1 + n])
    total, first = (float(numbers[0]) if members is None else numbers for numbers in statistics)
    return Checkpoint(
        done,
        float(seconds[0]),
        Windows(arrays["windows"]),
        Blocks(length, arrays["means"], total, pieces),
        arrays["numbers"],
        arrays["waiting"],
        first,
        left,
        passages,
        about["failure"],
        about.get("rank_pending", False),
        members,
    )


def progress_of(path: Path) -> tuple[int, int, bool]:
    """Return of how many members a checkpoint is, how many steps each has done, and whether it stopped early; (0, 0, False) if unread."""
    try:
        about = _about(arrays_in(path, str(path)))
        return len(about.get("members", [0])), about["counts"][0], bool(about["failure"])
    except (*UNREADABLE, BadInput, RecursionError, TypeError, AttributeError, IndexError):
        return 0, 0, False  # load says what is wrong with it


COLUMNS = 5
"""Columns of a table of windows."""

MOST_BLOCKS = 4096
"""Most means of blocks of a member."""

ABOUT = Fields(
    {"layout": Whole(LAYOUT, LAYOUT), "who": Named(_Plain()), "counts": Items(Whole(), 5, 5), "failure": Text(10_000)},
    {"rank_pending": Flag(), "members": Items(Whole(0, 10**6), most=10**5)},
)
"""What the text in a file says."""


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the content of a file of this layout, and its arrays."""
    try:
        whole = path.read_bytes()
        content, seal = whole[:-SEAL], whole[-SEAL:]
        if seal != _seal(content):
            raise ValueError("it is not what was written")
        arrays = arrays_in(io.BytesIO(content), str(path))
        _require_layout(path, strict(str(arrays["about"])))
        return _about(arrays), {name: arrays[name] for name in ("reals", "windows", "means", "numbers", "waiting")}
    except UNREADABLE as error:
        raise BadInput(f"{path} is damaged, or no checkpoint of a long run: {words(error)}; {ANEW}.", "checkpoint-damaged") from error


def _about(arrays: Mapping[str, Array]) -> dict[str, Any]:
    """Return the checked description in a file."""
    about = ABOUT.read(strict(str(arrays["about"])), "its text")
    length, members = about["counts"][3], about.get("members", [0])
    if length < 1 or length & (length - 1) or len(set(members)) < len(members):
        raise ValueError("its blocks have not a length that is a power of two, or a member is there twice")
    return about


def _require_shapes(path: Path, arrays: Mapping[str, Array], shapes: Mapping[str, tuple[int | None, ...]]) -> None:
    """Refuse arrays that have other shapes, None for any length, or entries that are no numbers, or statistics that are not finite."""
    for name, shape in shapes.items():
        array = arrays[name]
        fits = array.ndim == len(shape) and all(wanted in (None, length) for wanted, length in zip(shape, array.shape, strict=True))
        if not fits or array.dtype.kind != "f" or (name not in ("numbers", "waiting") and not np.isfinite(array).all()):
            raise BadInput(
                f"{path} is damaged, or no checkpoint of a long run: {name} has another shape, or is not numbers; {ANEW}.",
                "checkpoint-shape",
            )
    windows, means = arrays["windows"], arrays["means"]
    if windows.shape[-2] > len(EDGES) - 1 or means.shape[-1] > MOST_BLOCKS or (windows[..., COUNT] < 1).any():
        raise BadInput(
            f"{path} is damaged, or no checkpoint of a long run: its windows are not those of a series; {ANEW}.", "checkpoint-windows"
        )


def _seal(content: bytes) -> bytes:
    """Return the digest that follows the content of a file."""
    return hashlib.sha256(content).digest()


ANEW = "remove it to begin anew"

OTHER = "name another folder by --out, or remove it to begin anew"


def _require_layout(path: Path, about: Any) -> None:
    layout = about.get("layout")
    if layout != LAYOUT:
        raise BadInput(
            f"{path} is of another version of daebench (layout {shown(layout)}, here {LAYOUT}); {OTHER}.", "checkpoint-of-other-version"
        )


def _require_same(path: Path, about: dict[str, Any], who: dict[str, Any]) -> None:
    """Refuse the checkpoint of another run, or of this one as other versions compute it."""
    theirs = about["who"]
    differ = [name for name in who if theirs.get(name) != who[name]]
    if "definition" not in differ:
        differ = [name for name in differ if name != "problem"]  # its file may have been elsewhere
    named = [name for name in differ if name not in ("definition", "code", "versions")]
    if named:
        what = ", ".join(f"{name} = {_short(theirs.get(name))}, not {_short(who[name])}" for name in named)
        raise BadInput(f"{path} is of a run with {what}; {OTHER}.", "checkpoint-of-other-run")
    if "definition" in differ:
        raise BadInput(
            f"{path} is of another definition of {who['problem']}, whose file has changed since; {OTHER}.", "checkpoint-of-other-problem"
        )
    if "code" in differ:
        raise BadInput(f"{path} is of another text of {who['method']}, which has changed since; {OTHER}.", "checkpoint-of-other-method")
    if "versions" in differ:
        raise BadInput(
            f"{path} was made by another version of daebench or of its libraries, which may round differently; {OTHER}.",
            "checkpoint-of-other-libraries",
        )


def _short(value: Any) -> str:
    return shown(value) if not isinstance(value, str | list | tuple) else str(value)[:SHOWN]


def resumed(stream: Stream | LaneStream, checkpoint: Checkpoint, path: Path = Path("checkpoint")) -> None:
    """Put runs at their start to where a checkpoint left them; raise BadInput if it cannot be of these runs."""
    if checkpoint.numbers.shape != stream.numbers().shape or len(checkpoint.waiting) > stream.room:
        raise BadInput(f"{path} lacks numbers that this run needs; {ANEW}.", "checkpoint-numbers-missing")
    stream.restore(checkpoint)
