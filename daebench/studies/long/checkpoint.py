"""Checkpoints of long runs, alone and in lanes: one file for each, replaced as a whole, from which a run goes on to the same bits."""

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
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
from daebench.studies.long.run import LongRun, Stream
from daebench.studies.long.windows import COUNT, EDGES, Blocks, Windows

LAYOUT = 4
"""Version of the layout of the file: an archive of NumPy, and a digest of it."""

SEAL = hashlib.sha256().digest_size
"""Bytes of that digest; what reads archives of NumPy passes over it."""


class _Plain:
    """Anything that JSON has: it is compared, and nothing is made of it."""

    def read(self, value: Any, place: str) -> Any:
        """Return the value."""
        return value


@dataclass(frozen=True)
class Checkpoint:
    """A long run as it was left."""

    done: int
    """Steps done."""
    left: int
    """Steps to the next sample."""
    passages: int
    """Number of rank-loss events."""
    seconds: float
    """CPU time of the loop."""
    failure: str
    """Why it stopped; "" if nothing but the end or an interruption stopped it."""
    windows: Windows
    blocks: Blocks
    """Statistics of what is reduced."""
    numbers: Array
    """All that the loop carries; shape (k,)."""
    waiting: Array
    """Energies H(x) that are sampled and not yet reduced, in the run's number type; shape (n,)."""
    first: float
    """H(x0)."""
    rank_pending: bool = False
    """Whether G loses rank in the step after the last one."""

    @property
    def errors(self) -> Array:
        """Errors of the energy that are not yet reduced, shape(n,)."""
        return np.asarray(self.waiting - self.waiting.dtype.type(self.first), dtype=float)


@dataclass(frozen=True)
class GroupCheckpoint:
    """Members of an ensemble in lanes as they were left, all after as many steps; those that left their lanes have files of their own."""

    members: tuple[int, ...]
    """Their numbers."""
    done: int
    """Steps done."""
    seconds: float
    """CPU time of the loop."""
    windows: Windows
    blocks: Blocks
    """Statistics of what is reduced, a row for each member."""
    numbers: Array
    """All that the loop carries; shape (k, n)."""
    waiting: Array
    """Energies H(x) that are sampled and not yet reduced; shape (r, n)."""
    first: Array
    """H(x0); shape (n,)."""

    def each(self, stride: int) -> dict[int, Checkpoint]:
        """Return the members by number, as they would be left alone but for what the loop carries."""
        left, seconds = stride - self.done % stride, self.seconds / max(1, len(self.members))
        return {
            number: Checkpoint(
                done=self.done,
                left=left,
                passages=0,
                seconds=seconds,
                failure="",
                windows=self.windows.some(k),
                blocks=self.blocks.some(k),
                numbers=np.empty(0),
                waiting=self.waiting[:, k],
                first=float(self.first[k]),
            )
            for k, number in enumerate(self.members)
        }


def identity(spec: LongRun) -> dict[str, Any]:
    """Return all that decides the numbers of a run: its fields, its definition with its numbers, its code, and all versions."""
    code = {"code": spec.code} if spec.code else {}
    return {**spec.plain(), **code, "definition": digest(*defined_by(spec.ivp)), "versions": code_version()}


def group_identity(spec: LongRun) -> dict[str, Any]:
    """Return the same of the members of an ensemble in lanes, whichever these are."""
    return {name: value for name, value in identity(spec.member_of(0)).items() if name != "member"} | {"in": "lanes"}


def save(path: Path, who: dict[str, Any], stream: Stream) -> None:
    """Write a run as it is, whole or not at all."""
    run, blocks = stream.run, stream.blocks
    about = {
        "who": who,
        "counts": [run.done, run.left, stream.passages, blocks.length, blocks.pieces],
        "rank_pending": bool(run.rank_pending),
        "failure": run.failure or "",
    }
    arrays = {
        "reals": np.array([run.seconds, blocks.total, float(run.conserved[0])]),
        "windows": stream.windows.table,
        "means": blocks.means,
        "numbers": stream.numbers(),
        "waiting": run.state_rows[: run.row, 0],
    }
    _write(path, about, arrays)


def load(path: Path, who: dict[str, Any]) -> Checkpoint:
    """Return a run as it was left; raise BadInput if the file is damaged, or is of another run, another definition, or other versions."""
    about, arrays = _read(path, "rank_pending", "reals", "windows", "means", "numbers", "waiting")
    _require_same(path, about, who)
    _require_shapes(path, arrays, {"reals": (3,), "windows": (None, COLUMNS), "means": (None,), "numbers": (None,), "waiting": (None,)})
    done, left, passages, length, pieces = about["counts"]
    seconds, total, first = map(float, arrays["reals"])
    blocks = Blocks(length, arrays["means"], total, pieces)
    failure, pending, windows = about["failure"], about["rank_pending"], Windows(arrays["windows"])
    return Checkpoint(done, left, passages, seconds, failure, windows, blocks, arrays["numbers"], arrays["waiting"], first, pending)


def save_group(path: Path, who: dict[str, Any], stream: LaneStream) -> None:
    """Write the members that are in lanes as they are, whole or not at all."""
    blocks = stream.blocks
    about = {"who": who, "members": list(stream.members), "counts": [stream.done, 0, 0, blocks.length, blocks.pieces], "failure": ""}
    arrays = {
        "seconds": np.array(stream.seconds),
        "first": stream.first,
        "windows": stream.windows.table,
        "means": blocks.means,
        "total": np.asarray(blocks.total),
        "numbers": stream.numbers(),
        "waiting": stream.waiting,
    }
    _write(path, about, arrays)


def load_group(path: Path, who: dict[str, Any]) -> GroupCheckpoint:
    """Return members in lanes as they were left; raise BadInput as :func:`load` does."""
    about, arrays = _read(path, "members", "seconds", "first", "windows", "means", "total", "numbers", "waiting")
    _require_same(path, about, who)
    n = len(about["members"])
    shapes = {"seconds": (), "first": (n,), "windows": (n, None, COLUMNS), "means": (n, None), "total": (n,)}
    _require_shapes(path, arrays, {**shapes, "numbers": (None, n), "waiting": (None, n)})
    done, _, _, length, pieces = about["counts"]
    blocks = Blocks(length, arrays["means"], arrays["total"], pieces)
    group = Windows(arrays["windows"]), blocks, arrays["numbers"], arrays["waiting"], arrays["first"]
    return GroupCheckpoint(tuple(about["members"]), done, float(arrays["seconds"]), *group)


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


def _write(path: Path, about: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
    content = io.BytesIO()
    named: dict[str, Any] = {"about": np.array(json.dumps({"layout": LAYOUT, **about})), **arrays}
    np.savez(content, **named)
    with atomic(path) as scratch:
        scratch.write_bytes(content.getvalue() + _seal(content.getvalue()))


def _read(path: Path, field: str, *names: str) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the content of a file of this layout, with a field that tells of which kind it is, and its arrays."""
    try:
        whole = path.read_bytes()
        content, seal = whole[:-SEAL], whole[-SEAL:]
        if seal != _seal(content):
            raise ValueError("it is not what was written")
        arrays = arrays_in(io.BytesIO(content), str(path))
        _require_layout(path, strict(str(arrays["about"])))
        about = _about(arrays)
        if field not in about:
            raise ValueError(f"it has no {field}")
        return about, {name: arrays[name] for name in names}
    except UNREADABLE as error:
        raise BadInput(f"{path} is damaged, or no checkpoint of a long run: {words(error)}; {ANEW}.") from error


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
            raise BadInput(f"{path} is damaged, or no checkpoint of a long run: {name} has not its shape, or no numbers; {ANEW}.")
    windows, means = arrays["windows"], arrays["means"]
    if windows.shape[-2] > len(EDGES) - 1 or means.shape[-1] > MOST_BLOCKS or (windows[..., COUNT] < 1).any():
        raise BadInput(f"{path} is damaged, or no checkpoint of a long run: its windows are not those of a series; {ANEW}.")


def require_fitting(path: Path, shape: tuple[int, ...], expected: tuple[int, ...], waiting: int, room: int) -> None:
    """Accept numbers that a run can be restored from; raise BadInput if they are not as many as it carries, or too many samples wait."""
    if shape != expected or waiting > room:
        raise BadInput(f"{path} has not the numbers that this run carries; {ANEW}.")


def _seal(content: bytes) -> bytes:
    """Return the digest that follows the content of a file."""
    return hashlib.sha256(content).digest()


ANEW = "remove it to begin anew"

OTHER = "name another folder by --out, or remove it to begin anew"


def _require_layout(path: Path, about: Any) -> None:
    layout = about.get("layout")
    if layout != LAYOUT:
        raise BadInput(f"{path} is of another version of daebench (layout {shown(layout)}, here {LAYOUT}); {OTHER}.")


def _require_same(path: Path, about: dict[str, Any], who: dict[str, Any]) -> None:
    """Refuse the checkpoint of another run, or of this one as other versions compute it."""
    theirs = about["who"]
    differ = [name for name in who if theirs.get(name) != who[name]]
    if "definition" not in differ:
        differ = [name for name in differ if name != "problem"]  # its file may have been elsewhere
    named = [name for name in differ if name not in ("definition", "code", "versions")]
    if named:
        what = ", ".join(f"{name} = {_short(theirs.get(name))}, not {_short(who[name])}" for name in named)
        raise BadInput(f"{path} is of a run with {what}; {OTHER}.")
    if "definition" in differ:
        raise BadInput(f"{path} is of another definition of {who['problem']}, whose file has changed since; {OTHER}.")
    if "code" in differ:
        raise BadInput(f"{path} is of another text of {who['method']}, which has changed since; {OTHER}.")
    if "versions" in differ:
        raise BadInput(f"{path} was made by another version of daebench or of its libraries, which may round differently; {OTHER}.")


def _short(value: Any) -> str:
    return shown(value) if not isinstance(value, str | list | tuple) else str(value)[:SHOWN]


def resumed(stream: Stream, checkpoint: Checkpoint, path: Path = Path("checkpoint")) -> None:
    """Put a run at its start to where a checkpoint left it; raise BadInput if it cannot be of this run."""
    run = stream.run
    require_fitting(path, checkpoint.numbers.shape, stream.numbers().shape, len(checkpoint.waiting), len(run.state_rows) - 1)
    stream.restore(checkpoint.numbers)
    stream.windows, stream.blocks, stream.passages = checkpoint.windows, checkpoint.blocks, checkpoint.passages
    run.done, run.left, run.row, run.seconds = checkpoint.done, checkpoint.left, len(checkpoint.waiting), checkpoint.seconds
    run.state_rows[: run.row, 0] = checkpoint.waiting
    run.failure, run.rank_pending = checkpoint.failure or None, checkpoint.rank_pending
    run.passages.clear()
