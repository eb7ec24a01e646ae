"""Checkpoints of long runs: one file for each, replaced as a whole, from which a run goes on to the same bits."""

import hashlib
import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.runs.files import atomic
from daebench.runs.trajectory import Array
from daebench.studies.grid.run_specification import code_version, defined_by, digest
from daebench.studies.long.blocks import Blocks
from daebench.studies.long.run import LongRun, Stream
from daebench.studies.long.windows import Windows

LAYOUT = 3
"""Version of the layout of the file: an archive of NumPy, and a digest of it."""

SEAL = hashlib.sha256().digest_size
"""Bytes of that digest; what reads archives of NumPy passes over it."""


@dataclass(frozen=True)
class Checkpoint:
    """A long run as it was left.

    Parameters
    ----------
    done : int
        Steps done.
    left : int
        Steps to the next sample.
    passages : int
        Number of rank-loss events.
    seconds : float
        CPU time of the loop.
    failure : str
        Why it stopped; "" if nothing but the end or an interruption stopped it.
    windows, blocks : Windows, Blocks
        Statistics of what is reduced.
    numbers : ndarray, shape(k,)
        All that the loop carries.
    waiting : ndarray, shape(n,)
        Energies H(x) that are sampled and not yet reduced, in the run's number type.
    first : float
        H(x0).
    rank_pending : bool
        Whether G loses rank in the step after the last one.
    """

    done: int
    left: int
    passages: int
    seconds: float
    failure: str
    windows: Windows
    blocks: Blocks
    numbers: Array
    waiting: Array
    first: float
    rank_pending: bool = False

    @property
    def errors(self) -> Array:
        """Errors of the energy that are not yet reduced, shape(n,)."""
        return np.asarray(self.waiting - self.waiting.dtype.type(self.first), dtype=float)


def identity(spec: LongRun) -> dict[str, Any]:
    """Return all that decides the numbers of a run: its fields, its definition with its numbers, its code, and all versions."""
    code = {"code": spec.code} if spec.code else {}
    return {**spec.plain(), **code, "definition": digest(*defined_by(spec.ivp)), "versions": code_version()}


def save(path: Path, who: dict[str, Any], stream: Stream) -> None:
    """Write a run as it is, whole or not at all."""
    run, blocks = stream.run, stream.blocks
    about = {
        "layout": LAYOUT,
        "who": who,
        "counts": [run.done, run.left, stream.passages, blocks.length, blocks.pieces],
        "rank_pending": bool(run.rank_pending),
        "failure": run.failure or "",
    }
    content = io.BytesIO()
    np.savez(
        content,
        about=np.array(json.dumps(about)),
        reals=np.array([run.seconds, blocks.total, float(run.conserved[0])]),
        windows=stream.windows.table,
        means=blocks.means,
        numbers=stream.numbers(),
        waiting=run.state_rows[: run.row, 0],
    )
    with atomic(path) as scratch:
        scratch.write_bytes(content.getvalue() + _seal(content.getvalue()))


def load(path: Path, who: dict[str, Any]) -> Checkpoint:
    """Return a run as it was left; raise BadInput if the file is damaged, or is of another run, another definition, or other versions."""
    try:
        whole = path.read_bytes()
        content, seal = whole[:-SEAL], whole[-SEAL:]
        if seal != _seal(content):
            raise ValueError("it is not what was written")
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            about = json.loads(str(arrays["about"]))
            reals, windows, means, numbers, waiting = (arrays[name] for name in ("reals", "windows", "means", "numbers", "waiting"))
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise BadInput(f"{path} is damaged, or no checkpoint of a long run: {error}; remove it to begin anew.") from error
    _require_same(path, about, who)
    done, left, passages, length, pieces = about["counts"]
    blocks = Blocks(length, means, float(reals[1]), pieces)
    seconds, _, first = map(float, reals)
    failure, pending = about["failure"], about["rank_pending"]
    return Checkpoint(done, left, passages, seconds, failure, Windows(windows), blocks, numbers, waiting, first, pending)


def _seal(content: bytes) -> bytes:
    """Return what follows the content of a file: a digest of it."""
    return hashlib.sha256(content).digest()


def _require_same(path: Path, about: dict[str, Any], who: dict[str, Any]) -> None:
    """Refuse what another run left, or this one as other versions compute it."""
    other = "name another folder by --out, or remove it to begin anew"
    if about.get("layout") != LAYOUT:
        raise BadInput(f"{path} is of another version of daebench (layout {about.get('layout')}, here {LAYOUT}); {other}.")
    theirs = about["who"]
    differ = [name for name in who if theirs.get(name) != who[name]]
    if "definition" not in differ:
        differ = [name for name in differ if name != "problem"]  # its file may have been elsewhere
    named = [name for name in differ if name not in ("definition", "code", "versions")]
    if named:
        what = ", ".join(f"{name} = {theirs.get(name)}, not {who[name]}" for name in named)
        raise BadInput(f"{path} is of a run with {what}; {other}.")
    if "definition" in differ:
        raise BadInput(f"{path} is of another definition of {who['problem']}, whose file has changed since; {other}.")
    if "code" in differ:
        raise BadInput(f"{path} is of another text of {who['method']}, which has changed since; {other}.")
    if "versions" in differ:
        raise BadInput(f"{path} was made by another version of daebench or of its libraries, which may round differently; {other}.")


def resumed(stream: Stream, checkpoint: Checkpoint) -> None:
    """Put a run at its start to where a checkpoint left it."""
    run = stream.run
    stream.restore(checkpoint.numbers)
    stream.windows, stream.blocks, stream.passages = checkpoint.windows, checkpoint.blocks, checkpoint.passages
    run.done, run.left, run.row, run.seconds = checkpoint.done, checkpoint.left, len(checkpoint.waiting), checkpoint.seconds
    run.state_rows[: run.row, 0] = checkpoint.waiting
    run.failure, run.rank_pending = checkpoint.failure or None, checkpoint.rank_pending
    run.passages.clear()
