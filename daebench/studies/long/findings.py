"""``daebench.long``: the energy error over very many steps, and findings on an ensemble of long runs as it is now."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.random_walk import Walk
from daebench.draw.figures import save, save_table
from daebench.errors import BadInput, DaebenchError, Interrupted
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.files import make_folder
from daebench.runs.ivp import Ivp
from daebench.runs.machine import cores
from daebench.runs.outputs import require_own, writing
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Progress
from daebench.runs.result import Result, Table
from daebench.studies.grid.estimate import duration
from daebench.studies.long.ensemble import Ensemble, terminated_as_interrupted
from daebench.studies.long.run import STRIDE, Checkpoint, LongRun
from daebench.studies.long.table import Share, figure, growth, headline, members_table, sentence, share, windows_table
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure


LINES = 14
"""Approximate number of printed windows; the table has all."""


@dataclass(frozen=True)
class Findings:
    """Windows and verdict of what is kept of an ensemble."""

    ensemble: Ensemble
    """The ensemble, of which at least one member has begun."""
    members: dict[int, Checkpoint]
    """What is kept of its members."""

    @property
    def name(self) -> str:
        """The runs, in words."""
        spec = self.ensemble.spec
        return f"{spec.method}{', compensated' * spec.compensated} on {spec.problem}, case {spec.case}, h = {spec.h:g}"

    @cached_property
    def each(self) -> "pd.DataFrame":
        """Windows of each member."""
        return members_table(self.ensemble.spec, self.members)

    @cached_property
    def table(self) -> "pd.DataFrame":
        """Windows over all members."""
        return windows_table(self.each)

    @cached_property
    def growth(self) -> Walk | Drift | None:
        """How the energy error grows."""
        return growth(self.ensemble.spec, self.members)

    @property
    def verdict(self) -> str:
        """That in a sentence."""
        return sentence(self.growth, self.share)

    @property
    def share(self) -> Share:
        """Of which members, and up to when, that is."""
        return share(self.ensemble.spec, self.members, self.ensemble.members, self.ensemble.steps)

    @property
    def failures(self) -> dict[int, str]:
        """Why members stopped early."""
        return {number: checkpoint.failure for number, checkpoint in self.members.items() if checkpoint.failure}

    def plot(self) -> "Figure":
        """Return the picture, with the answer as its title."""
        return figure(f"{headline(self.growth)}\n{self.name}", self.each, self.table)

    def write(self, out: Path) -> None:
        """Write picture and tables to a folder; none where no member came to its first sample."""
        if len(self.each):
            save_table(out / f"{self.ensemble.stem}-members.csv", self.each)
            save(self.plot(), out, self.ensemble.stem, self.table)

    def printed(self) -> Iterator[str | Table]:
        """Yield about equidistant windows, including the last one, the verdict, and why members stopped early."""
        if length := len(self.table):
            spacing = max(1, length // LINES)
            shown = self.table.iloc[(length - 1) % spacing :: spacing].dropna(axis=1, how="all")
            rows = [[str(x) if name == "members" else f"{x:.3g}" for name, x in row.items()] for row in shown.to_dict("records")]
            yield Table(list(shown.columns), rows, self.name)
        yield self.verdict
        for number, why in self.failures.items():
            yield f"member {number}: {why} Its windows so far are stored."

    def plain(self) -> dict[str, Any]:
        """Return everything as JSON has it."""
        spec = self.ensemble.spec
        return {
            **{name: value for name, value in spec.plain().items() if name != "member"},
            "steps": [checkpoint.done for checkpoint in self.members.values()],
            "seconds": [checkpoint.seconds for checkpoint in self.members.values()],
            "passages": [checkpoint.passages for checkpoint in self.members.values()],
            "failures": self.failures,
            "growth": None if self.growth is None else asdict(self.growth),
            "told_from": asdict(self.share) | {"until": None if math.isnan(self.share.until) else self.share.until},
            "exponent": getattr(self.growth, "exponent", None),
            "standard_error": getattr(self.growth, "exponent_error", None),
            "exponent_low": getattr(self.growth, "exponent_low", None),
            "exponent_high": getattr(self.growth, "exponent_high", None),
            "verdict": self.verdict,
            "windows": self.table.to_dict("records"),
        }


@dataclass(frozen=True)
class LongRuns(Result):
    """Findings on long runs, a method each.

    Parameters
    ----------
    findings : tuple of Findings
        What is known of the runs of each method.
    out : Path
        Folder of their files.
    plans : tuple of str
        What is left to do, and about how long it takes, where only that is asked for.
    """

    findings: tuple[Findings, ...]
    out: Path
    plans: tuple[str, ...] = ()

    fails_if: ClassVar[str] = "a member stops early"

    @property
    def ivp(self) -> Ivp:
        """The problem."""
        return self.findings[0].ensemble.spec.ivp

    @property
    def status(self) -> int:
        """1 if a member stopped early."""
        return int(any(findings.failures for findings in self.findings))

    @property
    def table(self) -> "pd.DataFrame":
        """Windows over all members, by method."""
        return (
            pd.DataFrame()
            if not self.findings
            else pd.concat([findings.table.assign(method=findings.ensemble.spec.method) for findings in self.findings])
        )

    def summary(self) -> dict[str, Any]:
        """Return everything, for JSON."""
        plans = {"plans": list(self.plans)} if self.plans else {}
        return {"runs": [findings.plain() for findings in self.findings], **plans}

    def plot(self) -> "Figure":
        """Return the picture of the first method."""
        if not self.findings:
            raise DaebenchError("nothing has run, so that there is no picture.", "long-nothing-to-draw")
        return self.findings[0].plot()

    def printed(self) -> Iterator[str | Table]:
        """Yield the findings of each method with the names of its files, or the plans."""
        yield from self.plans
        for findings in self.findings:
            yield from findings.printed()
            path = self.out / f"{findings.ensemble.stem}.svg"
            if len(findings.each) and path.exists():
                yield f"written: {path.with_suffix('.csv')}, {path}"


def long(
    problem: str,
    *,
    methods: Sequence[str],
    h: float,
    steps: float = 1e8,
    case: str | None = None,
    ensemble: int = 1,
    stride: int = STRIDE,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    compensated: bool = False,
    precision: str = "float64",
    on_singular: str | None = None,
    anyway: bool = False,
    out: Path | str = Path("output/long"),
    workers: int | None = None,
    dry_run: bool = False,
    overwrite: bool = False,
    progress: Progress | None = None,
    **start: Unpack[OwnStart],
) -> LongRuns:
    """Follow the energy error over very many steps, and say whether it is bounded, a random walk, or drifts.

    Memory is bounded for any number of steps. The distinction of a random walk from a drift needs an ensemble of at least 16 starts. An
    individual drift of each start that adds a third to the spread mostly passes as a random walk with 256 starts, with an exponent of 0.51
    to 0.55, and less often with more starts. Ctrl-C and SIGTERM keep all results so far; the same call continues from there, to the same
    bits.

    >>> import daebench, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     runs = daebench.long("planar_pendulum", case="rotating", methods=["rattle"], h=0.01, steps=1e4, out=folder)
    >>> runs.findings[0].verdict.partition(":")[0]
    'bounded'

    Parameters
    ----------
    problem : str
        Name in the catalogue, or the path of a problem file, which is executed.
    methods : sequence of str
        Names of fixed-step methods; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    h : float
        Step size, s.
    steps : float
        Number of steps, for example 1e8.
    case : str, optional
        Named initial values; by default the problem's first.
    ensemble : int
        Number of starts; 16 or more can show a random walk.
    stride : int
        Steps between samples of the energy.
    parameters, options : mapping of str to float, optional
        Parameters of the problem, and free numbers of the methods.
    compensated : bool
        Whether sums over steps are compensated.
    precision : str
        Number type: "float64", "float32", or "mixed": forces in float32.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    anyway : bool
        Whether a scheme may run on a structure matrix for which it is not a Poisson integrator.
    out : Path
        Folder for tables, pictures and checkpoints.
    workers : int, optional
        Number of processes; by default one per core.
    dry_run : bool
        Print the number of steps to do and about how long they take, and do nothing.
    overwrite : bool
        Replace files of others.
    progress : callable, optional
        Called with the fraction done.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    LongRuns

    Raises
    ------
    BadInput
        If the runs cannot be made, or the folder has checkpoints of other runs.
    Interrupted
        If Ctrl-C or SIGTERM comes; its ``result`` has what is stored so far.
    """
    if not (steps >= 1 and steps == steps // 1 and steps <= 2.0**53):
        raise BadInput(f"--steps {steps:g} must be a whole number from 1 to 2^53.", "long-steps-out-of-range")
    out = Path(out)
    shared: dict[str, Any] = {"compensated": compensated, "precision": precision, "anyway": anyway, "on_singular": on_singular or ""}
    shared |= {"parameters": tuple((parameters or {}).items()), "options": tuple((options or {}).items()), "h": h, "stride": stride}
    case = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start).case
    runs = [LongRun(problem=problem, case=case, method=name, **shared) for name in methods]
    ensembles = [Ensemble(run, ensemble, int(steps), out / "checkpoints") for run in runs]
    for planned in ensembles:
        planned.check()
    with writing("daebench long", overwrite=overwrite), terminated_as_interrupted():
        _require_own(out, ensembles)
        if workers is not None and workers < 1:
            raise BadInput(f"--workers {workers} must be at least 1.", "workers-not-positive")
        at_once = min(workers or cores(), max(1, ensemble))
        if dry_run:
            return LongRuns((), out, tuple(_plan(planned, at_once) for planned in ensembles))
        return _followed(ensembles, at_once, out, progress)


def _followed(ensembles: Sequence[Ensemble], workers: int, out: Path, progress: Progress | None) -> LongRuns:
    """Run ensembles, and write what is found."""
    findings: list[Findings] = []
    for k, ensemble in enumerate(ensembles):
        try:
            ensemble.run(workers, partial(_tell, progress, k, len(ensembles)))
        except KeyboardInterrupt as stop:
            so_far = [*findings, *([Findings(ensemble, ensemble.kept())] if ensemble.kept() else [])]
            spec = ensemble.spec
            part = f"{100 * ensemble.done():.3g} % of {spec.method} on {spec.problem} is stored in {ensemble.folder}"
            raise Interrupted(f"interrupted; {part}: the same command continues from there.", LongRuns(tuple(so_far), out)) from stop
        findings.append(Findings(ensemble, ensemble.kept()))
        findings[-1].write(out)
    return LongRuns(tuple(findings), out)


def _require_own(out: Path, ensembles: Sequence[Ensemble]) -> None:
    """Refuse, before the runs, a folder that cannot be written to, and files there that the command did not write."""
    make_folder(out)
    for ensemble in ensembles:
        for ending in ("-members.csv", ".csv", ".svg", ".png"):
            require_own(out / f"{ensemble.stem}{ending}")
    make_folder(out / "checkpoints")


def _tell(progress: Progress | None, k: int, of: int, fraction: float) -> None:
    if progress:
        progress((k + fraction) / of)


def _plan(ensemble: Ensemble, workers: int) -> str:
    """Return the number of steps to do, and about how long they take, estimated from a short trial."""
    left = round((1 - ensemble.done()) * ensemble.members * ensemble.steps)
    rate, failure = ensemble.trial()
    lasts = f"a trial stopped early: {failure}" if failure else f"in about {duration(left / rate / workers)}."
    return f"{ensemble.spec.method}: {ensemble.members} x {ensemble.steps} steps, {left} of them to do; {lasts}"
