"""``daebench show``: one problem, its definition, parameters, cases, and the methods for it."""

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from daebench.cli.arguments import Json, Problem
from daebench.cli.console import print_json, print_table, printable
from daebench.cli.summary import print_part
from daebench.compiler.print.languages import FUNCTIONS, listed
from daebench.diagnostics.freedom import freedom
from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, kind_of, parse
from daebench.methods.registry import poisson_registry
from daebench.runs.mechanism import parts_as_json, parts_printed
from daebench.systems.parts import Parts

EQUATIONS = {
    "constrained": "q' = H_p,  p' = -H_q - G^T lam,  0 = g(q)      HLW (1.9)",
    "on velocities": "q' = H_p,  p' = -H_q - G^T lam,  0 = A(q) q' + a(q)      G has the rows of A, by d'Alembert's principle",
    "mixed": "q' = H_p,  p' = -H_q - G^T lam,  0 = g(q),  0 = A(q) q' + a(q)      G has the rows of g_q, then those of A",
    "free": "q' = H_p,  p' = -H_q      HLW (VI.1.4)",
    "poisson": "y' = B(y) grad H(y)      HLW (2.12)",
}


def show(
    problem: Problem,
    language: Annotated[
        str | None,
        typer.Option("--as", help=f"Print the functions of the problem and their derivatives as code: {listed(FUNCTIONS)}."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Show a problem: definition, parameters, cases, and methods for it; or its functions as code in another language."""
    problem_file = find_problem(problem)
    ivp = initial_value_problem(problem, consistent=False)
    if language is not None:
        if as_json and language != "json":
            raise BadInput(f"--as {language} prints code; leave --json out, or give --as json.", "json-beside-code")
        from daebench.compiler.printed import printed  # which imports SymPy

        print(printed(language, ivp.problem, ivp.source.derivation), end="")
        return
    from daebench.pages import definition  # which imports SymPy

    freedom_at_start, defined = _freedom(ivp), problem_file.define()
    if ivp.facts.KIND == "poisson":
        text, cases = definition.poisson(defined, ivp.facts)
    else:
        text, cases = definition.constrained(defined, freedom_at_start["degrees"] if freedom_at_start else None)
    about = {"problem": problem_file.name, "kind": problem_file.kind, "about": problem_file.summary, "definition": text}
    about |= {"parameters": {**problem_file.parameters, **problem_file.structure}, "cases": cases}
    about |= ({"freedom": freedom_at_start} if freedom_at_start else {}) | _use(ivp)
    parts = getattr(defined, "parts", None)
    parts = parts if isinstance(parts, Parts) else None  # those of a Poisson system are of its splittings
    if as_json:
        print_json(about | parts_as_json(parts))
    else:
        equations = problem_file.kind if not ivp.nonholonomic else "mixed" if ivp.holonomic else "on velocities"
        _print(about, parts, equations)


def _print(about: Mapping[str, Any], parts: Parts | None, equations: str) -> None:
    print(printable(f"{about['problem']}: {about['about']}\n"))
    print(f"{EQUATIONS[equations]}\n")
    print_table(["", ""], [[name, _lines(text)] for name, text in about["definition"].items()], "definition")
    for part in parts_printed(parts):
        print_part(part)
    print_table(["parameter", "default"], [[name, f"{value:g}"] for name, value in about["parameters"].items()], "parameters")
    states = [name for name in ("q", "p", "y") if name in next(iter(about["cases"].values()), {})]
    cases = [
        [
            name,
            *(case[state] for state in states),
            ", ".join(f"{parameter}={value:g}" for parameter, value in case["parameters"].items()),
            case["about"],
        ]
        for name, case in about["cases"].items()
    ]
    print_table(["case", *(f"{name}0" for name in states), "parameters", "about"], cases, "cases")
    if "about" in (freedom := about.get("freedom", {})):
        print(printable(f"rank of G at the start of {freedom['case']}: {freedom['rank']}; {freedom['about']}"))
    print("methods: " + ", ".join(about["methods"]))
    for name, why in about["refused"].items():
        print(f"not {name}: {why}")


def _freedom(ivp: Any) -> dict[str, Any] | None:
    """Return the rank of G at the start of a case, degrees of freedom, and redundant constraints; None if they are not known."""
    if ivp.facts.KIND == "poisson":
        return None
    counted = freedom(ivp)
    if counted is None:
        return None
    g = ivp.source.derivation.g if counted.others else []
    redundant = [{"constraint": k + 1, "name": ivp.named(k), "g": str(g[k]), "of": [j + 1 for j in of]} for k, of in counted.others.items()]
    known = {"case": ivp.case, "rank": counted.rank, "degrees": counted.degrees, "permanent": counted.permanent, "kind": counted.kind}
    return {**known, "redundant": redundant} | ({"about": f"{counted.named}, {counted.where}"} if redundant else {})


def _lines(text: str) -> str:
    """Return a matrix with a line for each row, and any other text unchanged."""
    return text.replace("], [", "],\n [")


def _use(ivp: Any) -> dict[str, Any]:
    """Return the methods for a problem, and the reasons why others do not apply."""
    kind = kind_of(ivp)
    names = _poisson_names() if ivp.facts.KIND == "poisson" else [method.name for method in kind.listed()]
    refusals = {name: parse(name, kind=kind).refusal(ivp) for name in names}
    return {
        "methods": [name for name, why in refusals.items() if why is None],
        "refused": {name: why for name, why in refusals.items() if why is not None},
    }


def _poisson_names() -> list[str]:
    """Return the methods for Poisson systems, including schemes in canonical coordinates and a lifted one."""
    names = [method.name for method in POISSON.listed()]
    canonical = [f"darboux:{name}" for name, claims in poisson_registry().items() if claims.poisson != "split"]
    return [*names, *(name for name in canonical if name not in names), "lifted:rattle"]
