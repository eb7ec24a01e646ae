"""Runs of a study from the command line: the plan of a dry run, the store, and the executors."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from daebench.cli.console import Bar, printable
from daebench.cli.executors import STORE, Executors, executors_of
from daebench.cli.folder import Folder
from daebench.errors import BadInput
from daebench.records.store import opened
from daebench.studies.grid.estimate import estimate
from daebench.studies.grid.runs import are_two_files, runs_of
from daebench.studies.grid.specification import key_of

if TYPE_CHECKING:
    import pandas as pd

    from daebench.records.store import Store
    from daebench.studies.grid.run_specification import GridRun
    from daebench.studies.grid.runs import Runs


@dataclass
class StoredRuns:
    """The function that makes the rows of a study for its command; store and executor are opened with the first runs, after all checks."""

    folder: Folder
    """Folder of tables and pictures, with the store if no other file is named."""
    executors: Executors
    """Executors of the runs."""
    store: Path | None
    """File of the store."""
    dry_run: bool
    """Whether only the plan of the first runs is printed, which are all that are known beforehand."""
    progress: Bar
    """Shows the method of each run."""
    stack: ExitStack
    """Closes the store and the executor."""
    made_again: str = ""
    """A sentence on stored runs that are outdated."""
    runs: "Runs | None" = None

    def __call__(self, specifications: "Sequence[GridRun]") -> "pd.DataFrame":
        """Return the rows of runs, in their order."""
        self.runs = self.runs or self._opened(specifications)
        return self.runs(specifications)

    def _opened(self, specifications: "Sequence[GridRun]") -> "Runs":
        self.folder.check()
        store = self.stack.enter_context(opened(self.store or self.folder.place / STORE))
        if self.dry_run:
            print(plan(specifications, store, self.executors))
            raise typer.Exit
        self.made_again = outdated(specifications, store)
        if shared_rows := shared(specifications, store):
            print(printable(shared_rows), file=sys.stderr)
        executor = self.stack.enter_context(self.executors.opened())
        return runs_of(store, executor=executor, tell=lambda done, of, run: self.progress(done / of, f"{run.method} on {run.problem}"))


@contextmanager
def stored_runs(folder: Folder, given: Mapping[str, Any], progress: Bar, *, timed: bool) -> Iterator[StoredRuns]:
    """Yield the function that makes the rows of a study, from the options of its command."""
    executors = executors_of(given, timed=timed, workers=given["workers"])
    with ExitStack() as stack:
        yield StoredRuns(folder, executors, given["store"], given["dry_run"], progress, stack)


def require_store(store: Path) -> None:
    """Refuse the path of a missing store."""
    if not store.is_file():
        raise BadInput(f"there is no store {store}; a study makes one, for example daebench work-precision.", "no-such-store")


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
