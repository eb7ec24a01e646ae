"""Tables of methods and problems, written from what schemes claim and problems declare: ``.. registry:: NAME``."""

from collections.abc import Callable
from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.forms import FORMS
from daebench.methods.fixed_step.parts import PROJECTIONS
from daebench.methods.formulations.table import FORMULATIONS, POISSON_FORMULATIONS
from daebench.methods.names import POISSON
from daebench.methods.registry import poisson_registry, registry
from daebench.schemes.kernels.claims import CLASSES

Rows = list[tuple[str, ...]]

STAYS = {
    "index3": "g = 0 to tolerance",
    "index2": "G H_p = 0 to tolerance",
    "index1": "neither",
    "ggl": "both to tolerance",
    "baumgarte": "drawn back to both",
    "ode": "neither",
}


def yes(value: bool) -> str:
    """Return a claim as a word."""
    return "yes" if value else "no"


def code(name: str) -> str:
    """Return a name in the markup of code."""
    return f"``{name}``"


def schemes_table() -> Rows:
    """Return the fixed-step schemes for constrained systems with what they claim."""
    rows: Rows = [("method", "solves", "order", "symmetric", "symplectic", "stays on", "source")]
    for name in schemes():
        claims = FixedStep(name).claims
        system = {"constrained": "(1.9)", "ode": "(1.18)"}.get(claims.system, claims.system)
        system += " with A v = 0" if claims.nonholonomic else ""
        manifolds = [text for text, keeps in (("g = 0", claims.keeps_g), ("G H_p = 0", claims.keeps_Gv)) if keeps]
        options = ", ".join(f"{option} = {value:g}" for option, value in registry()[name][1].options.items())
        title = f"{code(name)} ({options})" if options else code(name)
        properties = (str(claims.order), yes(claims.symmetric), yes(claims.symplectic), ", ".join(manifolds) or "neither")
        rows.append((title, system, *properties, claims.source))
    return rows


def solvers() -> Rows:
    """Return the solvers that choose their own steps, with the formulations that they take."""
    ida: Rows = [(code(f"ida:{name}"), about, "1-5", STAYS[name], "SUNDIALS IDA") for name, about in FORMULATIONS.items()]
    return [
        ("method", "solves", "order", "stays on", "source"),
        *ida,
        ("``cvode:adams`` ``cvode:bdf``", "(1.18)", "1-12, 1-5", "neither", "SUNDIALS CVODE"),
        ("``cvode:bdf:projected``", "(1.18)", "1-5", "g = 0, G H_p = 0 at the ends of its steps", "SUNDIALS CVODE, CVodeSetProjFn"),
        ("``scipy:DOP853`` ``scipy:Radau`` ...", "(1.18)", "8, 5, ...", "neither", "SciPy"),
        ("``heyoka:taylor``", "(1.18)", "by tolerance", "neither", "heyoka (extra ``peers``)"),
        ("``solve_dae:Radau``", "as ``ida:index2``", "5", "G H_p = 0 to tolerance", "solve_dae (extra ``peers``)"),
    ]


def parts() -> Rows:
    """Return what may stand around a scheme: forms, compositions, projections."""
    rows: Rows = [("part", "effect", "source")]
    for name, form in FORMS.items():
        options = ", ".join(f"{option} = {value:g}" for option, value in form.options.items())
        rows.append((code(f"{name}:"), f"{form.about}{f'; {options}' if options else ''}", ""))
    for name, composition in COMPOSITIONS.items():
        rows.append((code(f"/{name}"), f"order {composition.order} in {composition.stages} substeps", composition.source))
    return rows + [(code(f"+{name}"), about, "") for name, about in PROJECTIONS.items()]


def poisson() -> Rows:
    """Return the methods for Poisson systems."""
    rows: Rows = [("method", "Poisson integrator for", "order", "symmetric", "conserves also", "source")]
    for name, claims in poisson_registry().items():
        also = f"{claims.keeps} integrals" if claims.keeps else ""
        rows.append((code(name), CLASSES.get(claims.poisson, "no B"), str(claims.order), yes(claims.symmetric), also, claims.source))
    stays = {"casimirs": "Casimir functions, to tolerance", "ode": ""}
    rows += [
        (code(f"ida:{name}"), f"no B: {about}", "1-5", "no", stays[name], "SUNDIALS IDA") for name, about in POISSON_FORMULATIONS.items()
    ]
    return [
        *rows,
        ("``cvode:adams`` ``cvode:bdf``", "no B", "1-12, 1-5", "no", "", "SUNDIALS CVODE"),
        ("``scipy:DOP853`` ``scipy:Radau`` ...", "no B", "8, 5, ...", "no", "", "SciPy"),
        ("``heyoka:taylor``", "no B", "by tolerance", "no", "", "heyoka (extra ``peers``)"),
    ]


def poisson_forms() -> Rows:
    """Return the forms of Poisson systems."""
    return [("form", "meaning"), *((code(f"{name}:"), about) for name, about in POISSON.forms.items())]


def problems(kind: str) -> Rows:
    """Return the problems of a kind with their parameters and cases."""
    from daebench import list_problems

    table = list_problems()
    rows: Rows = [("problem", "description", "parameters", "cases")]
    for row in table[table["kind"] == kind].itertuples():
        parameters = ", ".join(f"{code(name)} = {value:g}" for name, value in row.parameters.items())
        rows.append((code(row.problem), row.summary, parameters, ", ".join(map(code, row.cases))))
    return rows


def metrics() -> Rows:
    """Return the metrics of studies."""
    from daebench.studies.grid.metrics import METRICS

    return [("metric", "columns"), *((code(name), ", ".join(map(code, metric.columns))) for name, metric in METRICS.items())]


TABLES: dict[str, Callable[[], Rows]] = {
    "schemes": schemes_table,
    "solvers": solvers,
    "parts": parts,
    "poisson": poisson,
    "poisson-forms": poisson_forms,
    "constrained-problems": lambda: problems("constrained"),
    "nonholonomic-problems": lambda: problems("nonholonomic"),
    "free-problems": lambda: problems("free"),
    "poisson-problems": lambda: problems("poisson"),
    "metrics": metrics,
}


def written(rows: Rows) -> list[str]:
    """Return a table as reStructuredText; its first row is its head."""
    lines = [".. list-table::", "   :header-rows: 1", "   :class: registry", ""]
    for row in rows:
        lines += [f"   * - {row[0]}", *(f"     - {cell}" for cell in row[1:])]
    return lines


class Registry(SphinxDirective):
    """A table by its name."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        return self.parse_text_to_nodes("\n".join(written(TABLES[self.arguments[0]]())))


def setup(app: Any) -> None:
    """Add the directive."""
    app.add_directive("registry", Registry)
