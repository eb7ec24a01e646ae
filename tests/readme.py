"""The README's table of methods, written from what the schemes claim: ``python tests/readme.py`` puts it in place."""

from pathlib import Path

from daebench.catalogue import schemes
from daebench.fixed_step import FixedStep
from daebench.pose import FORMULATIONS

README = Path(__file__).parent.parent / "README.md"
BEGIN, END = "<!-- methods -->", "<!-- end of methods -->"

STAYS = {
    "index3": "g = 0 to tolerance",
    "index2": "G H_p = 0 to tolerance",
    "index1": "neither",
    "ggl": "both to tolerance",
    "baumgarte": "drawn back to both",
    "ode": "neither",
}


def table():
    """Return the table as Markdown."""
    lines = ["| method | solves | order | symmetric | symplectic | stays on | source |", "|---|---|---|---|---|---|---|"]
    for name in schemes():
        claims = FixedStep(name).claims
        system = {"constrained": "(1.9)", "ode": "(1.18)"}[claims.system]
        kept = [text for text, keeps in (("g = 0", claims.keeps_g), ("G H_p = 0", claims.keeps_Gv)) if keeps]
        yes = ["yes" if value else "no" for value in (claims.symmetric, claims.symplectic)]
        lines.append(f"| `{name}` | {system} | {claims.order} | {yes[0]} | {yes[1]} | {', '.join(kept) or 'neither'} | {claims.source} |")
    lines += [f"| `ida:{name}` | {about} | 1-5 | no | no | {STAYS[name]} | SUNDIALS IDA |" for name, about in FORMULATIONS.items()]
    lines += [
        "| `cvode:adams` `cvode:bdf` | (1.18) | 1-12, 1-5 | no | no | neither | SUNDIALS CVODE |",
        "| `scipy:DOP853` `scipy:Radau` ... | (1.18) | 8, 5, ... | no | no | neither | SciPy |",
    ]
    return "\n".join(lines)


def replaced(text):
    """Return the README's text with the table in its place."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


if __name__ == "__main__":
    README.write_text(replaced(README.read_text(encoding="utf-8")), encoding="utf-8")
