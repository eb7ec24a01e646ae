"""A problem's definition as text, for either kind: ``daebench show`` prints it, and generated code has it in its README."""

import types
from collections.abc import Mapping
from typing import Any

Texts = tuple[dict[str, str], dict[str, dict[str, Any]]]
"""The parts of a definition by name, and its cases."""


def constrained(definition: Any, degrees: int | None = None) -> Texts:
    """Return the definition of a constrained problem as text, and its cases; for a chain, the definition at one node.

    ``degrees`` is the number of degrees of freedom, if known; otherwise it is positions minus constraints.
    """
    if hasattr(definition, "nodes"):
        return _chain(definition), _cases(definition.cases, ("q", "p"))
    text: dict[str, str] = {}
    if definition.H is not None:
        text["H"] = str(definition.H)
    else:
        text |= {"H": "1/2 p^T M^-1 p + U", "M": str(definition.M.tolist() if definition.M is not None else ""), "U": str(definition.U)}
    words = [f"{what}: " for what in definition.parts.constraints] if definition.parts else [""] * definition.m
    text |= {f"g{i}" if definition.m > 1 else "g": f"{words[i - 1]}{g}" for i, g in enumerate(definition.g, 1)}
    rolling = zip(words[len(definition.g) :], definition.velocity, strict=True)
    text |= {f"velocity{i}": f"{about}{row}" for i, (about, row) in enumerate(rolling, 1)}
    text |= {f"integral {name}": str(expression) for name, expression in definition.integrals.items()}
    degrees = definition.d - definition.m if degrees is None else degrees
    on = f" ({len(definition.velocity)} on velocities)" if definition.velocity else ""
    text["size"] = f"{definition.d} positions, {definition.m} constraints{on}, {degrees} degrees of freedom"
    for name, part in (("closed form", definition.closed_form), ("kinetic flow", definition.kinetic_flow), ("chart", definition.chart)):
        text[name] = "yes" if part else "no"
    return text, _cases(definition.cases, ("q", "p"))


def _chain(definition: Any) -> dict[str, str]:
    """Return the parts of the definition at node k, and at the joint from node k - 1 to it."""
    joint = "at each joint "
    text = {
        "H": "1/2 p^T M^-1 p + U",
        "q": f"{', '.join(map(str, definition.here))} at every node",
        "M": f"at every node {rows(definition.mass)}",
    }
    if definition.joint_mass is not None:
        text["M, joints"] = joint + rows(definition.joint_mass)
    text["U"] = f"sum over the nodes of {definition.pull * definition.U}"
    if definition.joint_U is not None:
        text["U, joints"] = f"sum over the joints of {definition.pull * definition.joint_U}"
    text |= {f"g, joint {i}": joint + str(g) for i, g in enumerate(definition.joints, 1)}
    text |= {f"g, own {i}": f"at every node {g}" for i, g in enumerate(definition.own, 1)}
    text["anchor"] = "none" if definition.anchor is None else ", ".join(map(str, definition.anchor))
    size = f"{definition.nodes} nodes, {definition.d} positions, {definition.m} constraints"
    return text | {"size": f"{size}, {definition.d - definition.m} degrees of freedom"}


def poisson(definition: Any, facts: types.ModuleType) -> Texts:
    """Return the definition of a Poisson system as text, and its cases; for a lattice, the definition at one site."""
    text = _lattice(definition) if hasattr(definition, "sites") else _written_out(definition)
    text["domain"] = ", ".join(f"{expression} > 0" for expression in facts.DOMAIN)
    text |= {f"splitting {name}": ", then ".join(parts) for name, parts in facts.SPLITTINGS.items()}
    text["closed form"] = "yes" if facts.CLOSED_FORM else "no"
    text["canonical coordinates"] = "yes" if facts.DARBOUX else "no"
    text["lift"] = facts.LIFT or "no"
    return {name: part for name, part in text.items() if part}, _cases(definition.cases, ("y",))


def _written_out(definition: Any) -> dict[str, str]:
    text = {"y": ", ".join(map(str, definition.y)), "B": rows(definition.B), "H": str(definition.H)}
    text |= {f"Casimir {name}": str(expression) for name, expression in definition.casimirs.items()}
    text |= {f"integral {name}": str(expression) for name, expression in definition.integrals.items()}
    text |= {f"part {name}": str(part.H) for name, part in definition.parts.items()}
    return text | {"size": f"{definition.n} coordinates"}


def _lattice(definition: Any) -> dict[str, str]:
    text = {"y": f"{', '.join(map(str, definition.here))} at every site", "B": f"at every site {rows(definition.b)}"}
    text |= {"H": f"sum over the sites of {definition.h}"}
    text |= {f"Casimir {name}": f"sum of {density}" for name, density in definition.casimirs.items()}
    text |= {f"integral {name}": f"sum of {density}" for name, density in definition.integrals.items()}
    text |= {f"part {name}": f"sum of {part.h}" for name, part in definition.parts.items()}
    return text | {"size": f"{definition.sites} sites, {definition.n} coordinates"}


def rows(matrix: Any) -> str:
    """Return a matrix as [[a, b], [c, d]]."""
    return str(matrix.tolist())


def _cases(cases: Mapping[str, Any], states: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    return {
        name: {state: ", ".join(map(str, getattr(case, state))) for state in states}
        | {"parameters": dict(case.parameters), "about": case.about}
        for name, case in cases.items()
    }
