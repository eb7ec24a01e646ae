"""The tables of a certificate and its sentences, each chosen by its numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.energy_verdict import LOST
from daebench.pages.report.sentences import NONE, at_most, listing, number, with_error
from daebench.pages.report.tables import Formats, code, column, table, text
from daebench.studies.certificate.record import Certificate, title
from daebench.studies.certificate.record import energy as energy_of
from daebench.studies.certificate.rounding import FALLS
from daebench.studies.claims.bench import FALLS_SHORT, NOT_APPLICABLE, NOT_CLAIMED, OK, UNDETERMINED

VERDICTS = {
    OK: "holds",
    FALLS_SHORT: "does not hold",
    UNDETERMINED: "undetermined",
    NOT_APPLICABLE: "not applicable",
    NOT_CLAIMED: "not claimed",
}
"""Verdicts on claims, as a certificate says them."""

TWO_FORMS = ("symplectic", "Poisson map")
"""Findings that are the defect of the structure, on a constrained problem and on a Poisson system."""


def known(value: Any) -> float:
    """Return a number of a certificate, NaN where it has none."""
    return float("nan") if value is None else float(value)


def order(numbers: Mapping[str, Any]) -> Markup:
    """Return the order with its standard error: that of the component of the state that has the lower one."""
    slopes = [part for part in numbers["orders"]["components"].values() if part["order"] is not None]
    if not slopes:
        return Markup(NONE)
    worst = min(slopes, key=lambda part: part["order"])
    return with_error(worst["order"], known(worst["standard_error"]))


def defect(numbers: Mapping[str, Any]) -> float:
    """Return the defect of the two-form, or of the Poisson structure."""
    return next((known(numbers["claims"][name]["measured"]) for name in TWO_FORMS if name in numbers["claims"]), float("nan"))


def holds(verdicts: Mapping[str, Sequence[str]]) -> str:
    """Return how many claims hold of those that are stated."""
    whole = sum(map(len, verdicts.values()))
    return f"{len(verdicts['holds'])} of {whole}" if whole else "none stated"


def answer(certificate: Certificate) -> Markup:
    """Return the first sentence of a certificate: how many claims hold, and which do not."""
    if not certificate.stated:
        return Markup("The code states no claims. Its properties were measured nevertheless.")
    said = Markup("{} of its {} claims hold").format(len(certificate.holds), certificate.stated)
    if certificate.falls_short:
        said += Markup("; <b>false:</b> {}").format(listing([code(name) for name in certificate.falls_short]))
    if certificate.undetermined:
        said += Markup("; unknown: {}").format(listing([code(name) for name in certificate.undetermined]))
    return said + "."


def facts(problem: Mapping[str, Any]) -> Markup:
    """Return the numbers of one problem in a sentence."""
    numbers, setting = problem["numbers"], problem["setting"]
    error, drift, conserved = numbers["error"], numbers["energy"], numbers["conserved"]
    parts = [
        _order_in_words(numbers),
        Markup("energy {} up to t = {:g}, its error at most {}").format(energy_of(numbers), drift["t"], at_most(known(drift["largest"]))),
        *([Markup("<b>more than the kinetic energy: the motion is lost</b>")] if known(drift["size"]) > LOST else []),
        Markup("error of a coordinate {} up to t = {:g} with h = {:g}").format(number(known(error["value"])), error["t"], setting["h"]),
        *([Markup("|<i>g</i>| at most {}").format(at_most(known(conserved["g"]), 1))] if "g" in conserved else []),
    ]
    return Markup("; ").join(parts) + "."


def _order_in_words(numbers: Mapping[str, Any]) -> Markup:
    if known(numbers["orders"]["contraction"]) > FALLS:
        return Markup("<b>no convergence to the motion</b>")
    slope = order(numbers)
    return Markup("order not known") if slope == NONE else Markup("order {}").format(slope)


# ---- tables

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
        row = {"problem": title(problem), "energy": known(energy["largest"]), "size": known(energy["size"]), "verdict": energy_of(measured)}
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
