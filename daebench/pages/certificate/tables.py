"""The tables of a certificate: each claim on each problem, the numbers of each problem, and the files of the code."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.pages.certificate.sentences import VERDICTS, known
from daebench.pages.certificate.sentences import energy as verdict
from daebench.pages.report.sentences import NONE, at_most, number, with_error
from daebench.pages.report.tables import Formats, code, column, table, text
from daebench.studies.certificate.record import Certificate, title
from daebench.studies.claims.bench import FALLS_SHORT

CLAIMED = {True: "yes", False: "no", None: NONE}
"""What is stated of a property."""


def claims(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each property on each problem: what is stated, what was measured, its bound and the verdict."""
    rows = [(title(problem), finding) for problem in certificate.measured for finding in problem["numbers"]["claims"].values()]
    frame = pd.DataFrame([{"property": finding["property"], "problem": where} for where, finding in rows])
    findings = [finding for _, finding in rows]
    frame["stated"] = [_stated(finding["claimed"]) for finding in findings]
    frame["measured"] = column([_measured(finding) for finding in findings], frame)
    frame["bound"] = column([_bound(finding) for finding in findings], frame)
    frame["verdict"] = column([_verdict(finding) for finding in findings], frame)
    formats: Formats = dict.fromkeys(("property", "verdict", "stated", "measured", "bound", "problem"), text)
    return table("claims", frame, formats, {}, caption)


def _stated(claimed: Any) -> str:
    return CLAIMED[claimed] if claimed is None or isinstance(claimed, bool) else str(claimed)


def _measured(finding: Mapping[str, Any]) -> Markup:
    if finding["property"] == "order":
        return with_error(known(finding["measured"]), known(finding["standard_error"]))
    return number(known(finding["measured"]))


def _bound(finding: Mapping[str, Any]) -> Markup:
    if finding["bound"] is None:
        return Markup(NONE)
    return Markup("{} {}").format(
        "more than" if finding["property"] == "order" else "at most", number(finding["bound"], 3 if finding["property"] == "order" else 2)
    )


def _verdict(finding: Mapping[str, Any]) -> Markup:
    word = VERDICTS[finding["verdict"]]
    return Markup("<b>{}</b>").format(word) if finding["verdict"] == FALLS_SHORT else Markup("{}").format(word)


def accuracy(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each problem: step size, orders of the components, and the error against what."""
    problems = certificate.measured
    frame = pd.DataFrame({"problem": list(map(title, problems)), "h": [f"{problem['setting']['h']:g}" for problem in problems]})
    errors = [problem["numbers"]["error"] for problem in problems]
    components = dict.fromkeys(name for problem in problems for name in problem["numbers"]["orders"]["components"])
    for name in components:
        frame[f"order of {name}"] = column([_order(problem["numbers"]["orders"]["components"].get(name)) for problem in problems], frame)
    frame["error"] = [known(error["value"]) for error in errors]
    frame["t"] = [f"{error['t']:g}" for error in errors]
    frame["against"] = [error["reference"] or error["failure"] or NONE for error in errors]
    formats: Formats = {"problem": text, **dict.fromkeys([f"order of {name}" for name in components], text), "h": text}
    headings = {"h": "h<small>s</small>", "error": "error<small>largest</small>", "t": "up to t<small>s</small>"}
    return table("accuracy", frame, formats | {"error": at_most, "t": text, "against": text}, headings, caption)


def _order(component: Mapping[str, Any] | None) -> Markup:
    return with_error(known(component["order"]), known(component["standard_error"])) if component else Markup(NONE)


def conservation(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each problem: the energy of the long run, what else is kept, and the time of a step."""
    times = dict(zip(map(id, certificate.content["problems"]), certificate.content["about"]["seconds_per_step"], strict=True))
    rows: list[dict[str, Any]] = []
    for problem in certificate.measured:
        measured, energy = problem["numbers"], problem["numbers"]["energy"]
        row = {"problem": title(problem), "energy": known(energy["largest"]), "size": known(energy["size"]), "verdict": verdict(measured)}
        rows.append(
            row | {"t": f"{energy['t']:g}", "conserved": _conserved(measured["conserved"]), "microseconds": 1e6 * known(times[id(problem)])}
        )
    frame = pd.DataFrame(rows)
    frame["conserved"] = column([row["conserved"] for row in rows], frame)
    formats: Formats = {
        "problem": text,
        "verdict": text,
        "energy": at_most,
        "size": at_most,
        "conserved": text,
        "t": text,
        "microseconds": number,
    }
    headings = {"verdict": "energy", "energy": "its error<small>largest</small>", "size": "its size<small>of kinetic energy</small>"}
    headings |= {"conserved": "kept to", "t": "up to t<small>s</small>", "microseconds": "a step<small>µs</small>"}
    return table("conservation", frame, formats, headings, caption)


def _conserved(errors: Mapping[str, Any]) -> Markup:
    """Return the largest errors of constraints, Casimir functions and first integrals."""
    names = {"g": Markup("|<i>g</i>|"), "Gv": Markup("|<i>G v</i>|")}
    return Markup(", ").join(Markup("{} {}").format(names.get(name, name), number(known(value), 1)) for name, value in errors.items())


def files(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each file that is run."""
    contents = certificate.content["code"]["files"] | {
        name: digest for problem in certificate.content["problems"] for name, digest in problem["files"].items()
    }
    names = [f"code/{name}" if name in certificate.content["code"]["files"] else name for name in contents]
    frame = pd.DataFrame({"file": names, "digest": list(contents.values())})
    return table("files", frame, {"file": code, "digest": code}, {"digest": "SHA-256"}, caption)
