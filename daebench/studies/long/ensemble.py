"""An ensemble of long runs: members in lanes, or by themselves where lanes do not apply, with checkpoints, in one process or several."""

import re
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from daebench.compiler.number_types import number_type
from daebench.errors import BadInput, DaebenchError
from daebench.records.seals import digest
from daebench.runs.own_start import base
from daebench.runs.trajectory import Array
from daebench.studies.grid.schedulers import local_processes
from daebench.studies.long.checkpoint import group_identity, identity, load, progress_of, resumed, save
from daebench.studies.long.lanes import AT_ONCE, GROUP, LaneStream, in_lanes
from daebench.studies.long.run import Checkpoint, LongRun, Stream, starts_of

PATIENCE = 2.0
"""Seconds after which what is under way is taken to hang, where somebody interrupts it again."""


@contextmanager
def held_back() -> Iterator[Callable[[], bool]]:
    """Hold back Ctrl-C and SIGTERM until the block has ended, and give what tells whether one came; only in the main thread.

    What is ignored outside is ignored inside. What does not end is ended by another one that comes :data:`PATIENCE` later.
    """
    came: list[int] = []
    times: list[float] = []

    def hold(number: int, _: Any) -> None:
        came.append(number)
        times.append(time.monotonic())
        if times[-1] - times[0] > PATIENCE:
            raise KeyboardInterrupt

    old = {signum: signal.getsignal(signum) for signum in (signal.SIGINT, signal.SIGTERM)}
    for signum in old:
        if old[signum] is not signal.SIG_IGN:
            signal.signal(signum, hold)
    try:
        yield lambda: bool(came)
    finally:
        for signum, handler in old.items():
            signal.signal(signum, handler)
        if came:
            signal.raise_signal(signal.Signals(came[0]))


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Have SIGTERM end the block as Ctrl-C does, by :class:`KeyboardInterrupt`."""
    old = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, old)


SECONDS = 5.0
"""Between checkpoints: what a run loses that is killed."""

MOST_MEMBERS = 10_000
"""Members that an ensemble may have: each has a start and windows of its own in memory."""

GLANCE = 1.0
"""Seconds between looks at how far other processes are."""

Tell = Callable[[float], None]


@dataclass(frozen=True)
class Ensemble:
    """Runs of the same motion from starts that round differently, see :func:`daebench.starts.members.neighbour`.

    Members are run in lanes, up to 128 together, which have a checkpoint in common; each has the bits of a run by itself. A member that
    cannot go on in its lane, and every member where lanes do not apply, is run by itself and has a checkpoint of its own.

    Parameters
    ----------
    spec : LongRun
        The run of member 0.
    members : int
        Number of members.
    steps : int
        Steps of each.
    folder : Path
        Where checkpoints are kept.
    """

    spec: LongRun
    members: int
    steps: int
    folder: Path

    def check(self) -> None:
        """Accept an ensemble that can be run, or gone on with.

        BadInput is raised if it cannot, or what is kept of it is of something else or has more steps than are asked for.
        """
        if self.members < 1:
            raise BadInput(f"an ensemble of {self.members} has no member; give at least 1.", "long-ensemble-empty")
        if self.members > MOST_MEMBERS:
            raise BadInput(
                f"an ensemble of {self.members} is more than {MOST_MEMBERS} members, kept in memory; 1024 are enough for an exponent.",
                "long-ensemble-too-large",
            )
        for number in range(min(2, self.members)):
            self.spec.member_of(number).check(self.steps)
        self._require_distinct()
        for number, checkpoint in self.kept().items():
            if checkpoint.done > self.steps:
                raise BadInput(
                    f"member {number} in {self.folder} has {checkpoint.done} steps already, and {self.steps} are requested; "
                    f"ask for {checkpoint.done} or more, or name another folder by --out.",
                    "member-beyond-request",
                )

    def _require_distinct(self) -> None:
        """Refuse members that would be the same run twice, for their spread would tell nothing."""
        first: dict[bytes, int] = {}
        for number, start in enumerate(self._starts().astype(number_type(self.spec.precision).dtype)):
            other = first.setdefault(start.tobytes(), number)
            if other != number:
                spec = self.spec
                raise BadInput(
                    f"members {other} and {number} of {spec.problem}, case {spec.case}, begin at the same state; run it once.",
                    "members-begin-alike",
                )

    def _starts(self) -> Array:
        """Return the start of each member, in a row."""
        spec, numbers = self.spec, range(self.members)
        if self._lanes:
            return np.concatenate(starts_of(spec.member_of(0).ivp, numbers, spec.h).start, axis=1)
        return np.array([np.concatenate(spec.member_of(number).ivp.start) for number in numbers])

    @cached_property
    def _lanes(self) -> bool:
        return self.members > 1 and in_lanes(self.spec)

    @property
    def stem(self) -> str:
        """Name that files of this ensemble begin with."""
        spec = self.spec
        case, whole = base(spec.case), spec.case
        # A start of one's own by its digest: its numbers may be more than a name of a file has room for.
        case = case if whole == case else f"{case}-{digest(whole)[:8]}"
        parts = [Path(spec.problem).stem, case, spec.method, f"h{spec.h!r}"]
        parts += ["compensated"] * spec.compensated + [spec.precision] * (spec.precision != "float64")
        return re.sub(r"[^A-Za-z0-9._+-]", "_", "-".join(parts))

    def path(self, *piece: int) -> Path:
        """Return where the checkpoint of a member is, or that of members in lanes given the first and the last of them."""
        return self.folder / f"{'-'.join([self.stem, *(f'{number:03d}' for number in piece)])}.npz"

    def _paths(self, numbers: int) -> dict[tuple[int, ...], Path]:
        """Return the checkpoints that there are whose names have so many numbers, 1 or 2, by these numbers."""
        form = re.compile(re.escape(self.stem) + numbers * r"-(\d+)" + r"\.npz")
        matches = {path: form.fullmatch(path.name) for path in sorted(self.folder.glob("*.npz"))}
        pieces = {tuple(map(int, match.groups())): path for path, match in matches.items() if match}
        return {piece: path for piece, path in pieces.items() if piece[0] < self.members}

    def kept(self) -> dict[int, Checkpoint]:
        """Return the checkpoints that there are, by member; raise BadInput if one is damaged or of something else."""
        together: dict[int, Checkpoint] = {}
        for path in self._paths(2).values():
            together |= load(path, group_identity(self.spec)).each(self.spec.stride)
        alone = {k: load(path, identity(self.spec.member_of(k))) for (k,), path in self._paths(1).items()}
        return {number: checkpoint for number, checkpoint in sorted((together | alone).items()) if number < self.members}

    def done(self) -> float:
        """Return the part of all steps that is done, as checkpoints tell it."""
        done = 0
        for path in [*self._paths(1).values(), *self._paths(2).values()]:
            members, steps, failed = progress_of(path)
            done += members * (self.steps if failed else steps)
        return min(1.0, done / (self.members * self.steps))

    def pieces(self, workers: int) -> "list[Piece]":
        """Return the members that are to be run, or gone on with, those together that are in lanes together."""
        checkpoints, alone = self.kept(), self._paths(1)
        groups = {path: load(path, group_identity(self.spec)) for path in self._paths(2).values()}
        begun = [self._piece(path, *(group.members or ())) for path, group in groups.items() if group.members and group.done < self.steps]
        going = [k for k, checkpoint in checkpoints.items() if not checkpoint.failure and checkpoint.done < self.steps]
        begun += [self._piece(self.path(k), k) for k in going if (k,) in alone]
        missing = [k for k in range(self.members) if k not in checkpoints]
        if not self._lanes:
            return [*begun, *(self._piece(self.path(k), k) for k in missing)]
        size = min(GROUP, max(1, -(-len(missing) // (workers * AT_ONCE))) * AT_ONCE)
        return [*begun, *(self._piece(self.path(run[0], run[-1]), *run) for run in _runs(missing, size))]

    def _piece(self, path: Path, *members: int) -> "Piece":
        return Piece(self.spec, members, self.steps, path, {k: self.path(k) for k in members})

    def run(self, workers: int, tell: Tell) -> None:
        """Take all members to their ends; what is done already is not done again.

        If Ctrl-C or SIGTERM comes, KeyboardInterrupt is raised with everything so far in the checkpoints.
        """
        pieces = self.pieces(workers)
        if workers > 1 and len(pieces) > 1:
            self._beside(pieces, min(workers, len(pieces)), tell)
            return
        for piece in pieces:
            share = len(piece.members) / self.members
            others = self.done() - share * progress_of(piece.path)[1] / self.steps
            run_piece(piece, partial(self._tell, tell, others, share))

    def _tell(self, tell: Tell, others: float, share: float, fraction: float) -> None:
        tell(min(1.0, others + share * fraction))

    def _beside(self, pieces: "Sequence[Piece]", workers: int, tell: Tell) -> None:
        """Run pieces in processes of their own, so many at a time."""
        with local_processes(workers) as pool:
            running = {pool.submit(run_piece, piece) for piece in pieces}
            for future in self._ended(running, tell):
                try:
                    future.result()
                except BrokenProcessPool as error:
                    raise DaebenchError(
                        "a process of the ensemble was lost; its checkpoints are stored: run again to go on.", "ensemble-process-ended"
                    ) from error

    def _ended(self, running: set[Future[None]], tell: Tell) -> Iterator[Future[None]]:
        while running:
            ended, running = wait(running, timeout=GLANCE)
            tell(self.done())
            yield from ended

    def trial(self, seconds: float = 0.3) -> tuple[float, str]:
        """Return the steps of members a second of CPU time in a trial of about so many seconds, and why that stopped early; "" if not."""
        members = range(min(self.members, GROUP))
        together = LaneStream(self.spec, members, self.steps) if self._lanes else None
        while together and together.going and together.seconds < seconds:
            together.advance()
        if together and together.members:
            return together.done * len(members) / max(together.seconds, 1e-9), ""
        alone = Stream(self.spec, self.steps)
        while alone.going and alone.seconds < seconds:
            alone.advance()
        return alone.done / max(alone.seconds, 1e-9), alone.failure


@dataclass(frozen=True)
class Piece:
    """Members that are run together, in lanes, or one that is run by itself."""

    spec: LongRun
    """The run of member 0."""
    members: tuple[int, ...]
    """Their numbers."""
    steps: int
    """Steps of each."""
    path: Path
    """The checkpoint."""
    alone: dict[int, Path]
    """Where the checkpoint of each is when it is run by itself; a piece whose own it is has one member, and no lanes."""


def _runs(numbers: Sequence[int], most: int) -> list[list[int]]:
    """Return increasing numbers in runs of consecutive ones, at most so many each."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and runs[-1][-1] == number - 1 and len(runs[-1]) < most:
            runs[-1].append(number)
        else:
            runs.append([number])
    return runs


def run_piece(piece: Piece, tell: Tell | None = None) -> None:
    """Take members to their ends from where their checkpoint left them; Ctrl-C and SIGTERM come once the checkpoint is written."""
    if piece.path in piece.alone.values():
        run_member(piece.spec.member_of(piece.members[0]), piece.steps, piece.path, tell)
        return
    for number in _run_lanes(piece, tell):
        run_member(piece.spec.member_of(number), piece.steps, piece.alone[number])


def _run_lanes(piece: Piece, tell: Tell | None) -> list[int]:
    """Take members to their ends in lanes; return those that left them, whose checkpoints are written."""
    spec, who, left = piece.spec, group_identity(piece.spec), []
    stream = LaneStream(spec, piece.members, piece.steps)
    if piece.path.exists():
        resumed(stream, load(piece.path, who), piece.path)

    def advance() -> None:
        for leaver in stream.advance():
            number = leaver.spec.member if isinstance(leaver, Stream) else leaver
            if isinstance(leaver, Stream) and not piece.alone[number].exists():
                save(piece.alone[number], identity(leaver.spec), leaver)
            left.append(number)

    _march(stream, advance, lambda: save(piece.path, who, stream), tell)
    return left


def run_member(spec: LongRun, steps: int, path: Path, tell: Tell | None = None) -> None:
    """Take a run to its end from where its checkpoint left it; Ctrl-C and SIGTERM come once the checkpoint is written."""
    who = identity(spec)
    stream = Stream(spec, steps)
    if path.exists():
        resumed(stream, load(path, who), path)
    _march(stream, stream.advance, lambda: save(path, who, stream), tell)


def _march(stream: Stream | LaneStream, advance: Callable[[], None], write: Callable[[], None], tell: Tell | None) -> None:
    """Advance to the end; the checkpoint is written every few seconds, and at the end, after a failure or an interruption."""
    with held_back() as stopped:
        written = time.monotonic()
        while stream.going and not stopped():
            advance()
            if tell:
                tell(stream.done / stream.steps)
            if time.monotonic() - written > SECONDS:
                write()
                written = time.monotonic()
        write()
