"""The README's tables of methods, written from what the schemes claim: ``python tests/readme.py`` puts them in place."""

from pathlib import Path

from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.forms import FORMS
from daebench.methods.fixed_step.parts import PROJECTIONS
from daebench.methods.formulations.table import FORMULATIONS, POISSON_FORMULATIONS
from daebench.methods.names import POISSON
from daebench.methods.registry import poisson_registry, registry
from daebench.schemes.kernels.claims import CLASSES

README = Path(__file__).parent.parent / "README.md"
PLACES = ("methods", "around", "poisson", "poisson_forms")

STAYS = {
    "index3": "g = 0 to tolerance",
    "index2": "G H_p = 0 to tolerance",
    "index1": "neither",
    "ggl": "both to tolerance",
    "baumgarte": "drawn back to both",
    "ode": "neither",
}


def around():
    """Return the table of what may stand around a scheme, as Markdown."""
    lines = ["| part | what it does | source |", "|---|---|---|"]
    for name, form in FORMS.items():
        options = ", ".join(f"{option} = {value:g}" for option, value in form.options.items())
        lines.append(f"| `{name}:` | {form.about}{f'; {options}' if options else ''} | |")
    for name, each in COMPOSITIONS.items():
        lines.append(f"| `/{name}` | order {each.order} in {each.stages} substeps | {each.source} |")
    lines += [f"| `+{name}` | {about} | |" for name, about in PROJECTIONS.items()]
    return "\n".join(lines)


def methods():
    """Return the table of methods, as Markdown."""
    lines = ["| method | solves | order | symmetric | symplectic | stays on | source |", "|---|---|---|---|---|---|---|"]
    for name in schemes():
        claims = FixedStep(name).claims
        system = {"constrained": "(1.9)", "ode": "(1.18)"}.get(claims.system, claims.system)
        kept = [text for text, keeps in (("g = 0", claims.keeps_g), ("G H_p = 0", claims.keeps_Gv)) if keeps]
        yes = ["yes" if value else "no" for value in (claims.symmetric, claims.symplectic)]
        options = ", ".join(f"{option} = {value:g}" for option, value in registry()[name][1].options.items())
        title = f"`{name}` ({options})" if options else f"`{name}`"
        row = (title, system, str(claims.order), *yes, ", ".join(kept) or "neither", claims.source)
        lines.append(f"| {' | '.join(row)} |")
    lines += [f"| `ida:{name}` | {about} | 1-5 | no | no | {STAYS[name]} | SUNDIALS IDA |" for name, about in FORMULATIONS.items()]
    lines += [
        "| `cvode:adams` `cvode:bdf` | (1.18) | 1-12, 1-5 | no | no | neither | SUNDIALS CVODE |",
        "| `cvode:bdf:projected` | (1.18) | 1-5 | no | no | g = 0, G H_p = 0 at the ends of its steps | SUNDIALS CVODE, CVodeSetProjFn |",
        "| `scipy:DOP853` `scipy:Radau` ... | (1.18) | 8, 5, ... | no | no | neither | SciPy |",
        "| `heyoka:taylor` | (1.18) | by tolerance | no | no | neither | heyoka (extra `peers`) |",
        "| `solve_dae:Radau` | as `ida:index2` | 5 | no | no | G H_p = 0 to tolerance | solve_dae (extra `peers`) |",
    ]
    return "\n".join(lines)


def poisson():
    """Return the table of methods for Poisson systems, as Markdown."""
    lines = ["| method | Poisson integrator for | order | symmetric | keeps besides | source |", "|---|---|---|---|---|---|"]
    for name, claims in poisson_registry().items():
        kept = f"{claims.keeps} integrals" if claims.keeps else ""
        row = (
            f"`{name}`",
            CLASSES.get(claims.poisson, "no B"),
            str(claims.order),
            "yes" if claims.symmetric else "no",
            kept,
            claims.source,
        )
        lines.append(f"| {' | '.join(row)} |")
    stays = {"casimirs": "Casimir functions, to tolerance", "ode": ""}
    lines += [f"| `ida:{name}` | no B: {about} | 1-5 | no | {stays[name]} | SUNDIALS IDA |" for name, about in POISSON_FORMULATIONS.items()]
    lines += [
        "| `cvode:adams` `cvode:bdf` | no B | 1-12, 1-5 | no |  | SUNDIALS CVODE |",
        "| `scipy:DOP853` `scipy:Radau` ... | no B | 8, 5, ... | no |  | SciPy |",
        "| `heyoka:taylor` | no B | by tolerance | no |  | heyoka (extra `peers`) |",
    ]
    return "\n".join(lines)


def poisson_forms():
    """Return the table of forms of Poisson systems, as Markdown."""
    lines = ["| form | what it is |", "|---|---|"]
    return "\n".join(lines + [f"| `{name}:` | {about} |" for name, about in POISSON.forms.items()])


def replaced(text):
    """Return the README's text with all tables in their places."""
    for place in PLACES:
        begin, end = f"<!-- {place} -->", f"<!-- end of {place} -->"
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        text = f"{before}{begin}\n{globals()[place]()}\n{end}{after}"
    return text


if __name__ == "__main__":
    README.write_text(replaced(README.read_text(encoding="utf-8")), encoding="utf-8")
