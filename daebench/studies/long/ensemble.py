"""An ensemble of long runs: members run in this process or side by side, each with a checkpoint of its own."""

import re
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.studies.grid.checkpoint import Checkpoint, identity, load, resumed, save
from daebench.studies.grid.interrupts import held_back
from daebench.studies.grid.schedulers import local_processes
from daebench.studies.long.run import LongRun, Stream

SECONDS = 5.0
"""Between checkpoints: what a run loses that is killed."""

MOST_MEMBERS = 10_000
"""Members that an ensemble may have: each has a start, a checkpoint and windows of its own in memory."""

GLANCE = 1.0
"""Seconds between looks at how far other processes are."""

Tell = Callable[[float], None]


@dataclass(frozen=True)
class Ensemble:
    """Runs of the same motion from starts that round differently, see :mod:`daebench.studies.long.initial_conditions`.

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
            raise BadInput(f"an ensemble of {self.members} has no member; give at least 1.")
        if self.members > MOST_MEMBERS:
            raise BadInput(f"an ensemble of {self.members} is more than {MOST_MEMBERS} members, each with a file; 16 tell a random walk.")
        for number in range(min(2, self.members)):
            self.specs[number].check(self.steps)
        self._require_distinct()
        for number, checkpoint in self.kept().items():
            if checkpoint.done > self.steps:
                raise BadInput(
                    f"{self.path(number)} has {checkpoint.done} steps already, and {self.steps} are asked for; "
                    f"ask for {checkpoint.done} or more, or name another folder by --out."
                )

    def _require_distinct(self) -> None:
        """Refuse members that would be the same run twice, for their spread would tell nothing."""
        first: dict[bytes, int] = {}
        for number, spec in enumerate(self.specs):
            start = b"".join(np.asarray(x, dtype=spec.precision).tobytes() for x in spec.ivp.start)
            other = first.setdefault(start, number)
            if other != number:
                raise BadInput(f"members {other} and {number} of {spec.problem}, case {spec.case}, begin at the same state; run it once.")

    @cached_property
    def specs(self) -> list[LongRun]:
        """The run of each member."""
        return [self.spec.member_of(number) for number in range(self.members)]

    @property
    def stem(self) -> str:
        """Name that files of this ensemble begin with."""
        spec = self.spec
        parts = [Path(spec.problem).stem, spec.case, spec.method, f"h{spec.h!r}"]
        parts += ["compensated"] * spec.compensated + [spec.precision] * (spec.precision != "float64")
        return re.sub(r"[^A-Za-z0-9._+-]", "_", "-".join(parts))

    def path(self, number: int) -> Path:
        """Return where a member's checkpoint is."""
        return self.folder / f"{self.stem}-{number:03d}.npz"

    def kept(self) -> dict[int, Checkpoint]:
        """Return the checkpoints that there are, by member; raise BadInput if one is damaged or of something else."""
        return {k: load(self.path(k), identity(spec)) for k, spec in enumerate(self.specs) if self.path(k).exists()}

    def done(self) -> float:
        """Return the part of all steps that is done, as checkpoints tell it."""
        step_counts = [self.steps if checkpoint.failure else checkpoint.done for checkpoint in self.kept().values()]
        return sum(step_counts) / (self.members * self.steps)

    def run(self, workers: int, tell: Tell) -> None:
        """Take all members to their ends; what is done already is not done again.

        If Ctrl-C or SIGTERM comes, KeyboardInterrupt is raised with everything so far in the checkpoints.
        """
        checkpoints = self.kept()
        left = {
            k: spec
            for k, spec in enumerate(self.specs)
            if k not in checkpoints or (not checkpoints[k].failure and checkpoints[k].done < self.steps)
        }
        if workers > 1 and len(left) > 1:
            self._beside(left, min(workers, len(left)), tell)
            return
        for k, spec in left.items():
            part = checkpoints[k].done / self.steps if k in checkpoints else 0.0
            others = self.done() - part / self.members
            run_member(spec, self.steps, self.path(k), partial(self._tell, tell, others))

    def _tell(self, tell: Tell, others: float, fraction: float) -> None:
        tell(others + fraction / self.members)

    def _beside(self, left: Mapping[int, LongRun], workers: int, tell: Tell) -> None:
        """Run members in processes of their own, so many at a time."""
        with local_processes(workers) as pool:
            running = {pool.submit(run_member, spec, self.steps, self.path(k)) for k, spec in left.items()}
            for future in self._ended(running, tell):
                try:
                    future.result()
                except BrokenProcessPool as error:
                    raise DaebenchError("a process of the ensemble ended; what was done is kept: run again to go on.") from error

    def _ended(self, running: "set[Future[None]]", tell: Tell) -> "Iterator[Future[None]]":
        while running:
            ended, running = wait(running, timeout=GLANCE)
            tell(self.done())
            yield from ended


def run_member(spec: LongRun, steps: int, path: Path, tell: Tell | None = None) -> None:
    """Take a run to its end from where its checkpoint left it; Ctrl-C and SIGTERM come once the checkpoint is written.

    The checkpoint is written every few seconds, and when the run is at its end, has failed, or is interrupted.
    """
    who = identity(spec)
    stream = Stream(spec, steps)
    if path.exists():
        resumed(stream, load(path, who))
    with held_back() as stopped:
        written = time.monotonic()
        while stream.going and not stopped():
            stream.advance()
            if tell:
                tell(stream.run.done / steps)
            if time.monotonic() - written > SECONDS:
                save(path, who, stream)
                written = time.monotonic()
        save(path, who, stream)
