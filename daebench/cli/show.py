"""``daebench show``: one problem, its definition, parameters, cases, and what can be run on it."""

from typing import TYPE_CHECKING, Any

from daebench.cli.arguments import Json, Problem
from daebench.cli.console import print_json, print_table

if TYPE_CHECKING:
    from daebench import catalogue


def show(
    problem: Problem,
    as_json: Json = False,
) -> None:
    """Show a problem: definition, parameters, cases, and what can be run on it."""
    from daebench.catalogue import find_problem

    found = find_problem(problem)
    about = _definition(found) | _use(found)
    if as_json:
        print_json(about)
        return
    print(f"{found.name}: {found.summary}\n")
    print("q' = H_p,  p' = -H_q - G^T lam,  0 = g(q)      HLW (1.9)\n")
    print_table(["", ""], [[name, str(text)] for name, text in about["definition"].items()], "definition")
    print_table(["parameter", "default"], [[name, f"{value:g}"] for name, value in about["parameters"].items()], "parameters")
    cases = [[name, case["q"], case["p"], case["parameters"], case["about"]] for name, case in about["cases"].items()]
    print_table(["case", "q0", "p0", "parameters", "about"], [[str(x) if x else "" for x in row] for row in cases], "cases")
    print("methods: " + ", ".join(about["methods"]))
    for name, why in about["refused"].items():
        print(f"not {name}: {why}")


def _definition(found: "catalogue.Problem") -> dict[str, Any]:
    definition = found.define()
    text: dict[str, str] = {}
    if definition.H is not None:
        text["H"] = str(definition.H)
    else:
        text |= {"H": "1/2 p^T M^-1 p + U", "M": str(definition.M.tolist() if definition.M is not None else ""), "U": str(definition.U)}
    text |= {f"g{i}" if definition.m > 1 else "g": str(g) for i, g in enumerate(definition.g, 1)}
    text |= {f"integral {name}": str(expression) for name, expression in definition.integrals.items()}
    text["size"] = f"{definition.d} positions, {definition.m} constraints, {definition.d - definition.m} degrees of freedom"
    for name, part in (("closed form", definition.closed_form), ("kinetic flow", definition.kinetic_flow), ("chart", definition.chart)):
        text[name] = "yes" if part else "no"
    cases = {
        name: {
            "q": ", ".join(map(str, case.q)),
            "p": ", ".join(map(str, case.p)),
            "parameters": dict(case.parameters),
            "about": case.about,
        }
        for name, case in definition.cases.items()
    }
    return {"problem": found.name, "about": found.summary, "definition": text, "parameters": _parameters(found), "cases": cases}


def _parameters(found: "catalogue.Problem") -> dict[str, float]:
    return {**found.parameters, **found.structure}


def _use(found: "catalogue.Problem") -> dict[str, Any]:
    from daebench.catalogue import find_scene
    from daebench.names import listed, parse

    scene = find_scene(found.name)
    refusals = {each.name: parse(each.name).refusal(scene) for each in listed()}
    return {
        "methods": [name for name, why in refusals.items() if why is None],
        "refused": {name: why for name, why in refusals.items() if why is not None},
    }
