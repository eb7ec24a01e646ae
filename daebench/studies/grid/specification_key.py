"""Whether a run of a study can be made, and the key under which its row is stored: both depend on what is measured of it."""

import json

from daebench.errors import BadInput
from daebench.runs.machine import machine
from daebench.studies.grid.against import certified_of
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.run_specification import COLUMNS, Cell, defined_by, digest, made_by


def require_possible(cell: Cell) -> None:
    """Accept a run that can be made; raise BadInput if it cannot, as where the method refuses the problem."""
    _require_own_columns(cell)
    solver = cell.solver
    solver.check(cell.ivp, cell.asked(solver.knob))


def _require_own_columns(cell: Cell) -> None:
    """Refuse numbers whose column would be overwritten."""
    measured = {column for name in cell.metrics if name in METRICS for column in METRICS[name].columns}
    given = [name for name, _ in (*cell.parameters, *cell.options)]
    for k, name in enumerate(given):
        if name in COLUMNS | measured or name in given[:k]:
            raise BadInput(f"{name} of {cell.problem} has the name of another column of a study's table; rename it to study it.")


def key_of(cell: Cell) -> str:
    """Return the hash of all that decides the numbers: run, definition, code, versions of libraries, reference, and processor.

    The reference is in it where an error against it is measured, and the processor where time is. The place of a problem file is not,
    nor its name: a folder that is moved, to another machine too, loses no row.
    """
    memory = vars(cell)  # of this cell alone: an equal one made later may find another text in the same file
    if "_key" not in memory:
        memory["_key"] = _key(cell)
    return str(memory["_key"])


def _key(cell: Cell) -> str:
    name = {"problem": ""} if cell.ivp.source.content else {}
    plain = json.dumps(cell.plain() | {"metrics": sorted(cell.metrics)} | name, sort_keys=True)
    timed_on = machine() if cell.repeat else ""
    return digest(plain, *defined_by(cell.ivp), made_by(), timed_on, _certificate(cell))


def _certificate(cell: Cell) -> str:
    """Return the checksum of the certificate, which has that of the numbers in it, or that there is none; "" without errors to measure."""
    if not any(METRICS[name].certified for name in cell.metrics if name in METRICS):
        return ""
    certified = certified_of(cell)
    return str(certified.certificate["checksum"]) if certified else "a finer run"
