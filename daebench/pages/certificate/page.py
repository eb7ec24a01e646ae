"""The page of a certificate."""

from pathlib import Path

from markupsafe import Markup

from daebench.pages.certificate import sentences, tables
from daebench.pages.certificate.figures import draw
from daebench.pages.report.page import write_page
from daebench.pages.report.pictures import picture
from daebench.studies.certificate.record import NAME, Certificate, title

ALT = "One row for each problem: on the left errors of the state over step sizes, on the right the energy error over time."


def write_page_of(certificate: Certificate) -> Path:
    """Write the page of a certificate, with its picture, into its folder; return its path."""
    return write_page(
        template(),
        certificate.folder / "index.html",
        command(certificate),
        certificate=certificate,
        answer=sentences.answer(certificate),
        facts=[(title(problem), sentences.facts(problem)) for problem in certificate.measured],
        drawn=lambda caption: picture(draw(certificate), ALT, caption),
        tables=tables,
        notes=_notes(certificate),
        verify=f"daebench certificate verify {NAME}{' --trust' * bool(certificate.content['code']['files'])}",
    )


def template() -> str:
    """Return the text of the template."""
    return (Path(__file__).parent / "page.html").read_text(encoding="utf-8")


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
