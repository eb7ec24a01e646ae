"""The tables of a certificate and its sentences, each chosen by its numbers."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from daebench.diagnostics.energy_verdict import LOST
from daebench.pages.report.sentences import NONE, at_most, listing, number, with_error
from daebench.pages.report.tables import Columns, Of, Table, code, text, write_tables
from daebench.studies.certificate.record import Certificate, title
from daebench.studies.certificate.record import energy as energy_of
from daebench.studies.certificate.rounding import FALLS
from daebench.studies.claims.bench import FALLS_SHORT, NOT_APPLICABLE, NOT_CLAIMED, OK, UNDETERMINED
from daebench.systems.lazily import pandas as pd

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

CLAIMED = {"True": "yes", "False": "no", "None": NONE}
"""Words for what is stated of a property, which may be an order as well."""


def tabulated(name: str, rows: Iterable[dict[str, Any]], columns: Columns, caption: str) -> Markup:
    """Return a table as HTML, without a file of its own."""
    return write_tables(Path(), {name: Table(pd.DataFrame(list(rows)), columns, {})})[name](caption)


def claims(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each property on each problem: what is stated, what was measured, its bound and the verdict."""
    rows = (
        {**finding, "problem": title(problem), "stated": CLAIMED.get(str(finding["claimed"]), str(finding["claimed"]))}
        for problem in certificate.measured
        for finding in problem["numbers"]["claims"].values()
    )
    columns = {"property": text, "verdict": Of(_verdict), "stated": text, "measured": Of(_measured), "bound": Of(_bound), "problem": text}
    return tabulated("claims", rows, columns, caption)


def _measured(finding: Mapping[str, Any]) -> Markup:
    if finding["property"] == "order":
        return with_error(known(finding["measured"]), known(finding["standard_error"]))
    return number(known(finding["measured"]))


def _bound(finding: Mapping[str, Any]) -> Markup:
    if math.isnan(bound := known(finding["bound"])):
        return Markup(NONE)
    words, digits = ("more than", 3) if finding["property"] == "order" else ("at most", 2)
    return Markup("{} {}").format(words, number(bound, digits))


def _verdict(finding: Mapping[str, Any]) -> Markup:
    return Markup("<b>{}</b>" if finding["verdict"] == FALLS_SHORT else "{}").format(VERDICTS[finding["verdict"]])


def accuracy(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each problem: step size, orders of the components, and the error against what."""
    problems = certificate.measured
    components = dict.fromkeys(name for problem in problems for name in problem["numbers"]["orders"]["components"])
    rows = []
    for problem in problems:
        error, orders = problem["numbers"]["error"], problem["numbers"]["orders"]["components"]
        against = error["reference"] or error["failure"] or NONE
        row = {"problem": title(problem), "h": f"{problem['setting']['h']:g}", "error": known(error["value"]), "t": f"{error['t']:g}"}
        rows.append(row | {"against": against, **{f"order of {name}": orders.get(name) for name in components}})
    orders_of = {f"order of {name}": Of(_order, f"order of {name}") for name in components}
    columns = {"problem": text, **orders_of, "h": "h<small>s</small>", "error": (at_most, "error<small>largest</small>")}
    return tabulated("accuracy", rows, columns | {"t": "up to t<small>s</small>", "against": text}, caption)


def _order(component: Any) -> Markup:
    return with_error(known(component["order"]), known(component["standard_error"])) if isinstance(component, Mapping) else Markup(NONE)


def conservation(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each problem: the energy of the long run, what else is kept, and the time of a step."""
    entries = zip(certificate.content["problems"], certificate.content["about"]["seconds_per_step"], strict=True)
    rows = (
        {
            "problem": title(problem),
            "verdict": energy_of(numbers),
            **{name: known(numbers["energy"][of]) for name, of in (("energy", "largest"), ("size", "size"))},
            "conserved": numbers["conserved"],
            "t": f"{numbers['energy']['t']:g}",
            "microseconds": 1e6 * known(seconds),
        }
        for problem, seconds in entries
        if (numbers := problem.get("numbers"))
    )
    columns = {
        "problem": text,
        "verdict": "energy",
        "energy": (at_most, "its error<small>largest</small>"),
        "size": (at_most, "its size<small>of kinetic energy</small>"),
        "conserved": (Of(_conserved, "conserved"), "kept to"),
        "t": "up to t<small>s</small>",
        "microseconds": (number, "a step<small>µs</small>"),
    }
    return tabulated("conservation", rows, columns, caption)


def _conserved(errors: Mapping[str, Any]) -> Markup:
    """Return the largest errors of constraints, Casimir functions and first integrals."""
    names = {"g": Markup("|<i>g</i>|"), "Gv": Markup("|<i>G v</i>|")}
    return Markup(", ").join(Markup("{} {}").format(names.get(name, name), number(known(value), 1)) for name, value in errors.items())


def files(certificate: Certificate, caption: str) -> Markup:
    """Return a row for each file that is run."""
    contents = {f"code/{name}": digest for name, digest in certificate.content["code"]["files"].items()}
    contents |= {name: digest for problem in certificate.content["problems"] for name, digest in problem["files"].items()}
    rows = ({"file": name, "digest": digest} for name, digest in contents.items())
    return tabulated("files", rows, {"file": code, "digest": (code, "SHA-256")}, caption)
