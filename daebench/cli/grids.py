"""What every command that makes the runs of a study does: say beforehand what there is to do, do it, and say what is kept."""

from typing import TYPE_CHECKING

from daebench.cli.console import bar
from daebench.cli.executors import Executors

if TYPE_CHECKING:
    import pandas as pd

    from daebench.studies.store import Store
    from daebench.studies.study import Study


def plan(study: "Study", store: "Store", executors: Executors) -> str:
    """Return how many runs a study has, how many are kept, and about how long the others take."""
    from daebench.studies.estimate import estimate

    cells = study.cells()
    missing = [cell for cell in cells if cell.key() not in store]
    found = f"{len(cells)} runs, {len(cells) - len(missing)} of them kept in {store.path}, {len(missing)} to make"
    count = executors.processes
    where = "in one process" if count == 1 else f"on {count} processes" if count else "in one process, and less on those of the cluster"
    time = f": {estimate(missing, store).sentence(count or 1, where)}" if missing else ""
    return " ".join(filter(None, (f"{found}{time}.", outdated(study, store))))


def outdated(study: "Study", store: "Store") -> str:
    """Return how many kept runs of a study are of no use any more and will be made again, as a sentence; "" if none."""
    count = store.outdated({cell.key(): cell.plain() for cell in study.cells()})
    verb = "run is" if count == 1 else "runs are"
    return f"{count} kept {verb} of another version of daebench, of a library or of the problem, and made again." if count else ""


def made(study: "Study", store: "Store", executors: Executors, label: str) -> "pd.DataFrame":
    """Return the rows of a study, with a progress bar.

    Raises
    ------
    Interrupted
        If the person at the keyboard ends it; what was done is kept.
    """
    from daebench.errors import Interrupted

    with bar(label) as progress, executors.opened() as executor:
        try:
            return study.table(store, executor=executor, tell=lambda done, of, cell: progress(done / of, f"{label}: {cell.method}"))
        except KeyboardInterrupt as stop:
            raise Interrupted(f"interrupted; {len(store)} runs are kept in {store.path}: run again to go on.") from stop
