"""Which of some methods can be run here and on a problem, and why the others cannot."""

from collections.abc import Sequence

from daebench.errors import BadInput
from daebench.methods.names import methods_of
from daebench.methods.solvers.drive import not_installed
from daebench.runs.ivp import Ivp


def installed(names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return those of these methods whose packages are installed, and what the others need, as sentences; refuse where none is left."""
    missing = {name: why for name in names if (why := not_installed(name))}
    if missing.keys() == set(names) and names:
        raise BadInput(" ".join(missing.values()))
    return [name for name in names if name not in missing], missing


def feasible(ivp: Ivp, names: Sequence[str], *, anyway: bool = False) -> tuple[list[str], dict[str, str]]:
    """Return those of these methods that can be run, and why the others cannot, as sentences; refuse ``anyway`` where it has no use."""
    methods_of(ivp, (), anyway=anyway)
    accepted_names: list[str] = []
    refused: dict[str, str] = {}
    for name in names:
        try:
            (solver,) = methods_of(ivp, [name], anyway=anyway)
            why = solver.refusal(ivp)
        except BadInput as error:
            why = str(error)
        if why:
            refused[name] = why
        else:
            accepted_names.append(name)
    return accepted_names, refused
