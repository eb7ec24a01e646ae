"""Facts of a problem as it declares them: sizes, structure, formulas, cases, integrals, and its references."""

import ast
import inspect
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup, escape

from daebench.diagnostics.freedom import freedom
from daebench.methods.catalogue import find_problem
from daebench.pages.report import MINUS, NONE, TIMES, count
from daebench.pages.report.tables import Of, Table
from daebench.reference.keep import store
from daebench.reference.keep.form import DATA
from daebench.reports.problems.ivps import definition, horizon, ivp_of, step_size
from daebench.systems.lazily import sympy as sp

LONGEST = 45
"""Largest number of operations of an expression that is written out."""

NEXT = re.compile(r"\. (?=[A-Z])")
"""Between two sentences; a product of vectors, written q_1 . q_2, is no end of one."""

SHOWN = 3
"""Largest number of constraints that are written out."""


@dataclass(frozen=True)
class Facts:
    """Facts of a problem that are known before any run.

    Parameters
    ----------
    name, summary, case : str
        Its name, a description in one line, and its first case.
    about : Markup
        The text of its definition without formulas: its source and its purpose.
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
        name, about, on_singular, certified (end of its reference, or None).
    """

    name: str
    summary: str
    case: str
    about: Markup
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

    @property
    def redundant(self) -> int:
        """Number of redundant constraints, m - rank G."""
        return self.dof - (self.d - self.m)


def facts(name: str) -> Facts:
    """Return the facts of a problem."""
    problem, ivp = find_problem(name), ivp_of(name)
    declared, in_time = definition(ivp), bool(ivp.facts.EXTENDED)
    has = {"chart": declared.chart, "kinetic flow": declared.kinetic_flow, "closed form": declared.closed_form}
    return Facts(
        name=name,
        summary=problem.summary,
        case=ivp.case,
        about=description(problem.path.read_text(encoding="utf-8")),
        d=ivp.d - in_time,
        m=ivp.m,
        dof=counted.degrees if (counted := freedom(ivp)) else ivp.d - in_time - ivp.m,
        in_time=in_time,
        outside=bool(ivp.facts.EXTENDED or ivp.facts.FORCED),
        structure=structure(declared),
        separable=bool(ivp.facts.SEPARABLE),
        formulas=formulas(declared),
        integrals=list(ivp.integrals),
        has=[feature for feature, what in has.items() if what is not None],
        cases=[case(name, case_name, declared_case) for case_name, declared_case in declared.cases.items()],
    )


def case(problem: str, name: str, declared: Any) -> dict[str, Any]:
    """Return a case, and the end of its certified reference."""
    known = f"{problem}-{name}" in store.names(DATA)
    certified = float(store.load(f"{problem}-{name}", DATA).t[-1]) if known else None
    return {"name": name, "about": declared.about, "on_singular": declared.on_singular, "certified": certified}


def description(text: str) -> Markup:
    """Return the prose of the docstring of ``problem`` in a file's text: without first line, formulas, parameters, half sentences."""
    tree = ast.parse(text)
    function = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "problem")
    doc = inspect.cleandoc(ast.get_docstring(function) or "").partition("\nParameters\n")[0]
    paragraphs = [
        " ".join(paragraph.split()) for paragraph in doc.split("\n\n")[1:] if paragraph.strip() and not paragraph.startswith((" ", "::"))
    ]
    prose = escape(" ".join(filter(None, map(whole_sentences, paragraphs))))
    marked = re.sub(r"``(.+?)``", r"<code>\1</code>", str(prose))
    return Markup(re.sub(r"\*(\w[^*]*)\*", r"<cite>\1</cite>", marked))


def whole_sentences(paragraph: str) -> str:
    """Return a paragraph without a last sentence that ends in a formula, and without a first sentence that begins with one."""
    if not paragraph.endswith("."):
        head, stop, _ = paragraph.rpartition(". ")
        paragraph = head + stop.strip()
    return paragraph if not paragraph[:1].islower() else "".join(NEXT.split(paragraph, maxsplit=1)[1:])


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
    definitions += [(f"g{k}", written(constraint)) for k, constraint in enumerate(declared.g[:SHOWN], start=1)]
    left = len(declared.g) - SHOWN
    definitions += [(f"g{SHOWN + 1}…", Markup("{} more of the same kind").format(left))] if left > 0 else []
    return [*definitions, *(("0", written(row)) for row in declared.velocity)]


def mass(declared: Any) -> Markup:
    """Return the mass matrix: its diagonal, or the whole matrix if it is small, or its size."""
    M = declared.M
    if M.is_diagonal():
        entries = list(M.diagonal())
        if len(set(entries)) == 1:
            return Markup("{} times the identity, {} by {}").format(written(entries[0]), *M.shape)
        return Markup("diagonal, {} by {}: {}").format(*M.shape, Markup(", ").join(written(entry) for entry in dict.fromkeys(entries)))
    if M.shape[0] <= 3:
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
        plan, certified = horizon(problem.name), [case["name"] for case in problem.cases if case["certified"] is not None]
        row = {"problem": problem.name, "d": problem.d, "m": problem.m, "dof": problem.dof, "mass": problem.structure}
        row |= {"integrals": ", ".join(problem.integrals), "has": ", ".join(problem.has), "cases": len(problem.cases)}
        row |= {"certified": len(certified), "h": step_size(problem.name), "t_end": plan.t_end, "unit": plan.unit, "why": plan.why}
        rows.append(row)
    return pd.DataFrame(rows)


def overview_table(frame: pd.DataFrame) -> Table:
    """Return the overview, one row per problem with a link to its section."""
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


def link(name: str) -> Markup:
    """Return the name of a problem with a link to its section."""
    return Markup('<a href="#{0}"><code>{0}</code></a>').format(name)
