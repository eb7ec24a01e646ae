"""Facts of a problem as it declares them: sizes, structure, formulas, cases, integrals, and its references."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.freedom import freedom
from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.docstrings import docstring, meanings
from daebench.pages.report import MINUS, NONE, TIMES, count, number
from daebench.pages.report.tables import Of, Table, code, long, text
from daebench.reports.problems.ivps import definition, horizon, step_size, usual
from daebench.reports.problems.prose import description
from daebench.reports.problems.references import certified, published
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.systems.constrained import ConstrainedHamiltonian
from daebench.systems.lazily import sympy as sp

LONGEST = 90
"""Largest number of operations of an expression that is written out."""

LARGEST = 3
"""Largest matrix that is written out."""

SHOWN = 6
"""Largest number of constraints that are written out."""


@dataclass(frozen=True)
class Facts:
    """Facts of a problem that are known before any run.

    Parameters
    ----------
    name, summary, case, method : str
        Its name, a description in one line, its first case, and a method that suits it.
    about : Markup
        Its definition in words and formulas: coordinates, source and purpose.
    parameters : list of (str, float, str)
        Names, defaults and meanings of its parameters.
    d, m, dof : int
        Positions without the time, constraints, and degrees of freedom d - rank G.
    in_time : bool
        Whether the time enters the equations.
    outside : bool
        Whether it is no system of HLW (1.9): the time enters, or a force has no potential.
    structure : str
        Kind of the mass matrix: "constant diagonal", "constant", "M(q)", or "H(p, q)".
    separable : bool
        Whether H = T(p) + U(q).
    formulas : list of (str, Markup)
        Names and MathML of the formulas, or words if a formula is too long.
    integrals, has : list of str
        First integrals other than H; further declarations: chart, kinetic flow, closed form.
    cases : list of dict
        name, about, on_singular, reference (or None).
    published : list of dict
        Numbers that others published, see :func:`daebench.reports.problems.references.published`.
    """

    name: str
    summary: str
    case: str
    method: str
    about: Markup
    parameters: list[tuple[str, float, str]]
    d: int
    m: int
    dof: int
    in_time: bool
    outside: bool
    structure: str
    separable: bool
    formulas: list[tuple[str, Markup]]
    integrals: list[str]
    has: list[str]
    cases: list[dict[str, Any]]
    published: list[dict[str, Any]]

    @property
    def redundant(self) -> int:
        """Number of redundant constraints, m - rank G."""
        return self.dof - (self.d - self.m)


def facts(name: str) -> Facts:
    """Return the facts of a problem of any kind."""
    problem, ivp = find_problem(name), initial_value_problem(name)
    doc = docstring(problem.path.read_text(encoding="utf-8"))
    meaning = meanings(doc)
    is_poisson = problem.kind == "poisson"
    declared: Any = ivp.source.define() if is_poisson else definition(constrained(ivp))
    return Facts(
        name=name,
        summary=problem.summary,
        case=ivp.case,
        method=usual(name),
        about=description(doc),
        parameters=[(key, value, meaning[key]) for key, value in {**problem.structure, **problem.parameters}.items()],
        cases=[_case(name, key, case) for key, case in declared.cases.items()],
        published=published(name),
        **(_poisson(declared) if is_poisson else _constrained(constrained(ivp), declared)),
    )


def _case(name: str, key: str, case: Any) -> dict[str, Any]:
    mode = getattr(case, "on_singular", "stop")
    return {"name": key, "about": case.about, "on_singular": mode, "reference": certified(name, key)}


def _constrained(ivp: ConstrainedIvp, declared: ConstrainedHamiltonian) -> dict[str, Any]:
    """Return the facts that only a constrained system has."""
    in_time = bool(ivp.facts.EXTENDED)
    has = {"chart": declared.chart, "kinetic flow": declared.kinetic_flow, "closed form": declared.closed_form}
    return {
        "d": ivp.d - in_time,
        "m": ivp.m,
        "dof": counted.degrees if (counted := freedom(ivp)) else ivp.d - in_time - ivp.m,
        "in_time": in_time,
        "outside": bool(ivp.facts.EXTENDED or ivp.facts.FORCED),
        "structure": structure(declared),
        "separable": bool(ivp.facts.SEPARABLE),
        "formulas": formulas(declared),
        "integrals": list(ivp.integrals),
        "has": [feature for feature, what in has.items() if what is not None],
    }


def _poisson(declared: Any) -> dict[str, Any]:
    """Return the facts of a Poisson system; a lattice is written in its docstring alone."""
    shown = {} if hasattr(declared, "sites") else {"H": declared.H, **declared.casimirs, **declared.integrals}
    if shown and declared.n <= LARGEST:
        shown = {"B": sp.Matrix(declared.B), **shown}
    plain = {"m": 0, "in_time": False, "outside": False, "structure": "", "separable": False, "has": []}
    written_out = [(name, written(expression)) for name, expression in shown.items()]
    return plain | {"d": declared.n, "dof": declared.n, "formulas": written_out, "integrals": [name for name in shown if name not in "BH"]}


def structure(declared: Any) -> str:
    """Return the kind of the mass matrix."""
    if declared.M is None:
        return "H(p, q)"
    if declared.M.free_symbols & set(declared.q):
        return "M(q)"
    return "constant diagonal" if declared.M.is_diagonal() else "constant"


def formulas(declared: Any) -> list[tuple[str, Markup]]:
    """Return the definition of the problem, as MathML if it is short, otherwise in words."""
    definitions = [("H", written(declared.H))] if declared.M is None else [("M", mass(declared)), ("U", written(declared.U))]
    definitions += [(f"F{k}", written(force)) for k, force in enumerate(declared.force or (), start=1) if force != 0][:SHOWN]
    definitions += [(f"g{k}", written(constraint)) for k, constraint in enumerate(declared.g[:SHOWN], start=1)]
    if (left := len(declared.g) - SHOWN) > 0:
        definitions.append((f"g{SHOWN + 1}…", Markup("{} more of the same kind").format(left)))
    definitions += [("0", written(row)) for row in declared.velocity]
    return definitions + [(name, written(integral)) for name, integral in declared.integrals.items()]


def mass(declared: Any) -> Markup:
    """Return the mass matrix: its diagonal, or the whole matrix if it is small, or its size."""
    M = declared.M
    if M.is_diagonal():
        entries = list(M.diagonal())
        if len(set(entries)) == 1:
            return Markup("{} times the identity, {} by {}").format(written(entries[0]), *M.shape)
        return Markup("diagonal, {} by {}: {}").format(*M.shape, Markup(", ").join(written(entry) for entry in dict.fromkeys(entries)))
    if M.shape[0] <= LARGEST:
        return written(sp.Matrix(M))
    filled = sum(M[i, j] != 0 for i in range(M.shape[0]) for j in range(M.shape[0]))
    where = "depending on q" if M.free_symbols & set(declared.q) else "constant"
    return Markup("{} by {}, {}, {} non-zero entries").format(*M.shape, where, filled)


def written(expression: Any) -> Markup:
    """Return an expression as MathML, or its length if it is too long to be read."""
    expression = sp.sympify(expression)
    if sp.count_ops(expression) > LONGEST:
        return Markup("an expression of {} operations").format(int(sp.count_ops(expression)))
    renamed = {symbol: sp.Symbol(str(symbol).replace("_", " ")) for symbol in expression.free_symbols if "_" in str(symbol)}
    return Markup("<math>{}</math>").format(Markup(mathematics(sp.mathml(expression.subs(renamed), printer="presentation"))))


def mathematics(markup: str) -> str:
    """Return MathML with a thin space for each product and with minus signs."""
    return (
        markup.replace("<mo>&InvisibleTimes;</mo>", '<mspace width="0.2em"/>')
        .replace("<mo>-</mo>", f"<mo>{MINUS}</mo>")
        .replace("<mn>-", f"<mn>{MINUS}")
    )


def overview_frame(facts: Sequence[Facts]) -> pd.DataFrame:
    """Return one row per problem: sizes, structure, declarations, references, and the step and end of its runs."""
    rows = []
    for problem in facts:
        plan, certified = horizon(problem.name), [case["name"] for case in problem.cases if case["reference"]]
        row = {"problem": problem.name, "d": problem.d, "m": problem.m, "dof": problem.dof, "mass": problem.structure}
        row |= {"integrals": ", ".join(problem.integrals), "has": ", ".join(problem.has), "cases": len(problem.cases)}
        row |= {"certified": len(certified), "h": step_size(problem.name), "t_end": plan.t_end, "unit": plan.unit, "why": plan.why}
        rows.append(row)
    return pd.DataFrame(rows)


def overview_table(frame: pd.DataFrame) -> Table:
    """Return the overview, one row per problem with a link to its page."""
    return Table(
        frame,
        {
            "problem": (link, "problem"),
            "d": (count, "<i>d</i>"),
            "m": (count, "<i>m</i>"),
            "dof": (count, "degrees<small>of freedom</small>"),
            "mass": "mass matrix",
            "integrals": (lambda names: names or NONE, "integrals<small>besides H</small>"),
            "references": (Of("{} of {}".format, "certified", "cases"), "certified<small>cases</small>"),
            "end": (Of(lambda t, unit: f"{t:g} {'' if unit == 's' else TIMES + ' '}{unit}", "t_end", "unit"), "run to"),
        },
    )


def parameters_table(problem: Facts) -> Table:
    """Return the parameters of a problem with their defaults and meanings."""
    frame = pd.DataFrame(problem.parameters, columns=["name", "default", "meaning"])
    return Table(
        frame,
        {"name": (code, "parameter"), "default": (lambda value: f"{value:g}".replace("-", MINUS), "default"), "meaning": (long, "meaning")},
        {},
    )


def published_table(problem: Facts) -> Table:
    """Return published numbers beside those of the certified reference."""
    frame = pd.DataFrame(problem.published)
    shown = {
        "name": text,
        "t": (partial(number, digits=3), "<i>t</i>"),
        "published": (digits, "published"),
        "certified": (digits, "certified"),
    }
    return Table(frame, shown | {"off": (partial(number, digits=1), "difference"), "source": (long, "by")})


def digits(value: float) -> str:
    """Return a number with all digits that it has."""
    return repr(float(value)).replace("-", MINUS)


def link(name: str) -> Markup:
    """Return the name of a problem with a link to its page."""
    return Markup('<a href="{0}.html"><code>{0}</code></a>').format(name)
