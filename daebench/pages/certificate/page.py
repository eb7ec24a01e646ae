"""The page of a certificate, with its picture: errors over step sizes, and the energy error over time, a row a problem."""

from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from daebench.draw.figures import BLUE, QUIET, curve, drawing, grid_of_axes, legend_below, save
from daebench.pages.certificate import tables
from daebench.pages.report.page import write_page
from daebench.pages.report.pictures import picture
from daebench.studies.certificate.record import NAME, Certificate, energy, title
from daebench.systems.lazily import pandas as pd

ALT = "One row for each problem: on the left errors of the state over step sizes, on the right the energy error over time."


def write_page_of(certificate: Certificate) -> Path:
    """Write the page of a certificate, with its picture, into its folder; return its path."""
    return write_page(
        (Path(__file__).parent / "page.html").read_text(encoding="utf-8"),
        certificate.folder / "index.html",
        command(certificate),
        certificate=certificate,
        answer=tables.answer(certificate),
        facts=[(title(problem), tables.facts(problem)) for problem in certificate.measured],
        drawn=lambda caption: picture(draw(certificate), ALT, caption),
        tables=tables,
        notes=_notes(certificate),
        verify=f"daebench certificate verify {NAME}{' --trust' * bool(certificate.content['code']['files'])}",
    )


def command(certificate: Certificate) -> str:
    """Return the command that makes such a certificate, in the folder of the code."""
    content = certificate.content
    parts = ["daebench certify", f"'{certificate.method}'" if " " in certificate.method else certificate.method]
    if not all(problem["guessed"] for problem in content["problems"]):
        parts += [f"--problem {problem['problem']}{':' * bool(problem['case'])}{problem['case'] or ''}" for problem in content["problems"]]
    parts += [f"--param {name}={value!r}" for name, value in content["problems"][0]["changed"].items()]
    parts += [f"--claim {name}={str(value).lower()}" for name, value in content["claims"].items()]
    parts += [f"--option {name}={value!r}" for name, value in content["options"].items()]
    steps = content["problems"][0]["h"]
    parts += [f"--h {steps!r}"] if steps else []
    parts += ["--anyway"] if content["anyway"] else []
    parts += [f"--on-singular {content['on_singular']}"] if content.get("on_singular") else []
    return " ".join([*parts, "--out DIR"])


def _notes(certificate: Certificate) -> list[tuple[str, str, Markup]]:
    """Return the notes on single findings: title of the problem, property and sentence."""
    return [
        (title(problem), finding["property"], Markup.escape(finding["note"]))
        for problem in certificate.measured
        for finding in problem["numbers"]["claims"].values()
        if finding["note"]
    ]


def draw(certificate: Certificate) -> Path:
    """Write the picture of a certificate and its data into its folder; return the path of the SVG."""
    problems = certificate.measured
    data = pd.concat([part for problem in problems for part in (_errors_of(problem), _energies_of(problem))], ignore_index=True)
    with drawing():
        figure, axes = grid_of_axes(len(problems), 2, 0.9 + 2.1 * len(problems))
        for (left, right), problem in zip(axes, problems, strict=True):
            _errors(left, problem)
            _energy(right, problem)
        axes[-1, 0].set_xlabel("step size h (s)")
        axes[-1, 1].set_xlabel("time t (s)")
        legend_below(figure, axes[0, 0], 4)
        return save(figure, certificate.folder / "figures", "measured", data)


def _errors_of(problem: Any) -> "pd.DataFrame":
    """Return the errors of an order study, a row for each component and step size."""
    orders = problem["numbers"]["orders"]
    frames = [
        pd.DataFrame({"problem": title(problem), "quantity": f"error of {name}", "h": orders["h"], "value": values})
        for name, values in orders["errors"].items()
    ]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()


def _energies_of(problem: Any) -> "pd.DataFrame":
    """Return the least and the largest energy error over spans of time."""
    spans = problem["numbers"]["curve"]
    frames = [
        pd.DataFrame({"problem": title(problem), "quantity": f"{name} energy error", "t": spans["t"], "value": spans[name]})
        for name in ("least", "largest")
    ]
    return pd.concat(frames, ignore_index=True)


def _errors(axis: Any, problem: Any) -> None:
    orders = problem["numbers"]["orders"]
    for k, (name, values) in enumerate(orders["errors"].items()):
        axis.loglog(orders["h"], np.array(values, dtype=float), label=f"error of {name}", **curve(k))
    axis.axvline(problem["setting"]["h"], color=QUIET, linewidth=0.8, linestyle=(0, (2, 2)), label="h of all other runs")
    axis.set_ylabel("largest error")
    axis.set_title(title(problem).replace("$", r"\$"))


def _energy(axis: Any, problem: Any) -> None:
    spans = problem["numbers"]["curve"]
    axis.fill_between(spans["t"], spans["least"], spans["largest"], color=BLUE, linewidth=0.5, alpha=0.8)
    axis.axhline(0.0, color=QUIET, linewidth=0.8)
    axis.set_ylabel("energy error")
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    axis.set_title(f"energy: {energy(problem['numbers'])}")
