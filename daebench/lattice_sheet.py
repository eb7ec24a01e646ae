"""The sheet of a Poisson lattice, with the names of :mod:`daebench.poisson_sheet`."""

from daebench.lattice_derivation import LatticeDerivation


def source(problem: str, derivation: LatticeDerivation) -> str:
    """Return the source of a lattice's sheet; SITES is its number of sites."""
    lattice = derivation.lattice
    facts = {
        "KIND": "poisson",
        "N": lattice.n,
        "PARAMETERS": {str(symbol): float(value) for symbol, value in lattice.parameters.items()},
        "POSITIVE": tuple(str(symbol) for symbol in lattice.parameters if symbol.is_positive),
        "CASES": {name: {"parameters": dict(case.parameters), "about": case.about} for name, case in lattice.cases.items()},
        "CASIMIRS": tuple(lattice.casimirs),
        "INTEGRALS": tuple(lattice.integrals),
        "DOMAIN": (),
        "CONSTANT": not lattice.b.free_symbols & set(lattice.here),
        "BILINEAR": False,
        "HALVES": len(lattice.here) % 2 == 0,
        "SPLITTINGS": {name: tuple(parts) for name, parts in lattice.splittings.items()},
        "LINEAR": derivation.of_degree(1),
        "QUADRATIC": derivation.of_degree(2),
        "CLOSED_FORM": False,
        "DARBOUX": lattice.darboux is not None,
        "LIFT": "",
        "SITES": lattice.sites,
    }
    lines = [f'"""Facts about {problem}."""', "from numpy import *", *(f"{name} = {value!r}" for name, value in facts.items())]
    lines += [derivation.initial(f"initial_{k}", case.y) for k, case in enumerate(lattice.cases.values())]
    pairs = ", ".join(f"{name!r}: initial_{k}" for k, name in enumerate(lattice.cases))
    return "\n".join([*lines, f"INITIAL = {{{pairs}}}", ""])
