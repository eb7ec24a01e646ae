"""Tables of problems and methods: ``daebench.list_problems`` and ``daebench.list_methods``."""

import warnings
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from daebench.compiler.definition import source_in
from daebench.errors import DaebenchError
from daebench.methods import catalogue, names
from daebench.methods.registry import poisson_registry, registry
from daebench.systems.lazily import pandas as pd


def list_problems() -> "pd.DataFrame":
    """Return all problems, one per row: name, kind, summary, parameters, cases; with a warning on each that cannot be used.

    Returns
    -------
    DataFrame
        Columns problem, kind ("constrained", "nonholonomic", "free" of constraints, or "poisson"), summary, parameters (names to
        defaults), cases (a list).

    Examples
    --------
    >>> import daebench
    >>> problems = daebench.list_problems().set_index("problem")
    >>> problems.loc["spherical_pendulum", "cases"]
    ['fig1.1', 'fig1.2', 'fig1.2b']
    """
    others = catalogue.plugins()
    broken, rows = list(others.broken.values()), []
    for name, file in {**catalogue.problems(), **others.problems}.items():
        try:
            cases = list(source_in(file, {}).facts.CASES)
        except DaebenchError as error:
            if file.own:
                raise
            broken.append(f"problem {name} of {file.package} cannot be used: {error}")
            continue
        parameters = {**file.parameters, **file.structure}
        rows.append({"problem": name, "kind": file.kind, "summary": file.summary, "parameters": parameters, "cases": cases})
    for sentence in broken:
        warnings.warn(sentence, stacklevel=2)
    return pd.DataFrame(rows)


def list_methods() -> "pd.DataFrame":
    """Return all methods, one per row: name, kind of problem, knob, system, and for schemes their claims.

    Returns
    -------
    DataFrame
        Columns kind, method, knob, system, options, and the fields of :class:`daebench.schemes.kernels.claims.Claims` and
        :class:`daebench.schemes.kernels.claims.PoissonClaims`, missing if a method makes no such claim.

    Examples
    --------
    >>> import daebench
    >>> methods = daebench.list_methods()
    >>> rattle = methods[(methods["method"] == "rattle") & (methods["kind"] == "constrained")].iloc[0]
    >>> int(rattle["order"]), bool(rattle["symplectic"]), rattle["source"]
    (2, True, 'HLW (1.25), (1.26)')
    """
    claims: dict[str, Mapping[str, Any]] = {
        "constrained": {name: member.claims for name, (_, member) in registry().items()},
        "poisson": poisson_registry(),
    }
    rows = [
        {"kind": kind, **asdict(method)} | (asdict(claims[kind][method.name]) if method.name in claims[kind] else {})
        for kind, table in names.KINDS.items()
        for method in table.listed()
    ]
    return pd.DataFrame(rows).rename(columns={"name": "method"}).convert_dtypes()
