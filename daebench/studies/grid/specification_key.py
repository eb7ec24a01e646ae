"""Whether a run of a study can be made, and the key under which its row is stored: both depend on what is measured of it."""

import json

from daebench.errors import BadInput
from daebench.records.code import made_by
from daebench.records.seals import digest
from daebench.runs.machine import machine
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.reference import certified_of
from daebench.studies.grid.run_specification import COLUMNS, GridRun, defined_by


def require_possible(specification: GridRun) -> None:
    """Accept a run that can be made; raise BadInput if it cannot, as where the method refuses the problem."""
    _require_own_columns(specification)
    solver = specification.solver
    solver.check(specification.ivp, specification.asked(solver.knob))


def _require_own_columns(specification: GridRun) -> None:
    """Refuse numbers whose column would be overwritten."""
    measured = {column for name in specification.metrics if name in METRICS for column in METRICS[name].columns}
    given = [name for name, _ in (*specification.parameters, *specification.options)]
    for k, name in enumerate(given):
        if name in COLUMNS | measured or name in given[:k]:
            raise BadInput(f"{name} of {specification.problem} has the name of another column of a study's table; rename it to study it.")


def key_of(specification: GridRun) -> str:
    """Return the hash of all that decides the numbers: run, definition, code, versions of libraries, reference, and processor.

    The reference is in it where an error against it is measured, the processor where time is, and of a method from outside its files. The
    place of a problem file is not, nor its name or its text: a folder that is moved, to another machine too, or a comment, loses no row.
    """
    memory = vars(specification)  # of this run alone: an equal one made later may find another text in the same file
    if "_key" not in memory:
        memory["_key"] = _key(specification)
    return str(memory["_key"])


def _key(specification: GridRun) -> str:
    name = {"problem": ""} if specification.ivp.source.outside else {}
    plain = json.dumps(specification.plain() | {"metrics": sorted(specification.metrics)} | name, sort_keys=True)
    code = filter(None, [specification.code])
    timed_on = machine() if specification.repeat else ""
    return digest(plain, *defined_by(specification.ivp), made_by(), timed_on, _certificate(specification), *code)


def _certificate(specification: GridRun) -> str:
    """Return the checksum of the certificate, which has that of the numbers in it, or that there is none; "" without errors to measure."""
    if not any(METRICS[name].certified for name in specification.metrics if name in METRICS):
        return ""
    certified = certified_of(specification)
    return str(certified.certificate["checksum"]) if certified else "a finer run"
