"""Runs of a study from the command line: the request, the plan of a dry run, the store, and a progress bar."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from daebench.cli.console import bar, methods_if_given, printable
from daebench.cli.executors import Executors
from daebench.cli.folder import Folder
from daebench.errors import BadInput, positive
from daebench.records.store import opened
from daebench.runs.texts import numbers
from daebench.studies.grid.estimate import estimate
from daebench.studies.grid.runs import are_two_files, runs_of
from daebench.studies.grid.specification import key_of
from daebench.studies.stability.extreme import Asked

if TYPE_CHECKING:
    from daebench.records.store import Store
    from daebench.studies.grid.run_specification import GridRun
    from daebench.studies.grid.runs import Runs
    from daebench.studies.stability.extreme import Asked


@dataclass(frozen=True)
class StudyCommand:
    """Arguments of a command on a study other than the study itself.

    Parameters
    ----------
    store : Path, optional
        The store of its runs; ``studies.db`` in the folder if left out.
    folder : Folder
        Folder of tables and pictures.
    executors : Executors
        Executors of the runs.
    left_out : mapping of str to str
        Methods that are left out, each with the reason.
    dry_run, json : bool
        Whether only the plan is printed, and whether results are printed as JSON.
    """

    store: Path | None
    folder: Folder
    executors: Executors
    left_out: Mapping[str, str]
    dry_run: bool
    json: bool

    def runs(self, specifications: "Sequence[GridRun]", label: str) -> "AbstractContextManager[tuple[Runs, str]]":
        """Yield the function that makes the rows of a study, see :func:`study_runs`."""
        return study_runs(specifications, self.store, self.folder, self.executors, label, dry_run=self.dry_run)


def asked_of(problem: str, case: str | None, *, methods: str | None, h: str | None, t_end: float | None, **more: Any) -> "Asked":
    """Return the request by comma-separated names of methods and step sizes; refuse steps and ends that are not positive."""
    return Asked(
        problem=problem,
        case=case,
        methods=methods_if_given(methods) or (),
        t_end=None if t_end is None else positive("--t-end", t_end),
        h=[positive("--h", value) for value in numbers("--h", h) or ()],
        **more,
    )


def require_store(store: Path) -> None:
    """Refuse the path of a missing store."""
    if not store.is_file():
        raise BadInput(f"there is no store {store}; a study makes one, for example daebench work-precision.")


def plan(specifications: "Sequence[GridRun]", store: "Store", executors: Executors) -> str:
    """Return the number of runs of a study, the number of stored ones, and about how long the others take."""
    missing = [specification for specification in specifications if key_of(specification) not in store]
    runs, new = (sum(specification.count for specification in some) for some in (specifications, missing))
    counts = f"{runs} runs, {runs - new} of them stored in {store.path}, {new} to make"
    count = executors.processes
    where = "in one process" if count == 1 else f"on {count} processes" if count else "in one process, and less on those of the cluster"
    time = f": {estimate(missing, store).sentence(count or 1, where)}" if missing else ""
    return " ".join(filter(None, (f"{counts}{time}.", outdated(specifications, store), shared(specifications, store))))


def outdated(specifications: "Sequence[GridRun]", store: "Store") -> str:
    """Return a sentence on the stored runs of a study that are outdated and will be made again; "" if there are none."""
    keys = {key_of(specification): specification for specification in specifications}
    outdated_keys = store.outdated({key: specification.plain() for key, specification in keys.items()})
    count = sum(keys[key].count for key in outdated_keys)
    verb = "run is" if count == 1 else "runs are"
    return f"{count} stored {verb} of another version of daebench, of a library or of the problem, and made again." if count else ""


def shared(specifications: "Sequence[GridRun]", store: "Store") -> str:
    """Return a sentence on stored runs that were made for another file with the same problem; "" if there are none."""
    rows = [(specification, store.get(key_of(specification))) for specification in specifications]
    others = [(run.count, str(row["problem"])) for run, row in rows if row and are_two_files(str(row["problem"]), run.problem)]
    count, files = sum(runs for runs, _ in others), ", ".join(dict.fromkeys(file for _, file in others))
    verb = "run was" if count == 1 else "runs were"
    return f"{count} stored {verb} made for {files}, with the same equations, numbers and cases." if count else ""


@contextmanager
def making(store: "Store", executors: Executors, label: str) -> "Iterator[Runs]":
    """Yield the function that makes the rows of a study, with a progress bar, for the time of a block."""
    with bar(label) as progress, executors.opened() as executor:
        yield runs_of(
            store, executor=executor, tell=lambda done, of, specification: progress(done / of, f"{label}: {specification.method}")
        )


@contextmanager
def study_runs(
    specifications: "Sequence[GridRun]", store: Path | None, folder: Folder, executors: Executors, label: str, *, dry_run: bool
) -> "Iterator[tuple[Runs, str]]":
    """Yield the function that makes the rows of a study, and the sentence on outdated runs; a dry run prints the plan and exits."""
    folder.check()
    with opened(store or folder.place / "studies.db") as run_store:
        if dry_run:
            print(plan(specifications, run_store, executors))
            raise typer.Exit
        again = outdated(specifications, run_store)
        if shared_rows := shared(specifications, run_store):
            print(printable(shared_rows), file=sys.stderr)
        with making(run_store, executors, label) as runs:
            yield runs, again
