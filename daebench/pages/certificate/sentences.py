"""Sentences on a certificate, each chosen by its numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from daebench.diagnostics.energy_verdict import LOST
from daebench.pages.report.sentences import NONE, at_most, listing, number, with_error
from daebench.pages.report.tables import code
from daebench.studies.certificate.convergence import FALLS
from daebench.studies.certificate.record import Certificate
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


def energy(numbers: Mapping[str, Any]) -> str:
    """Return the verdict on the energy, with the law of a drift."""
    law = numbers["energy"]["law"]
    return str(numbers["energy"]["verdict"]) + (f", {law}" if law else "")


def holds(verdicts: Mapping[str, Sequence[str]]) -> str:
    """Return how many claims hold of those that are stated."""
    whole = sum(map(len, verdicts.values()))
    return f"{len(verdicts['holds'])} of {whole}" if whole else "none stated"


def answer(certificate: Certificate) -> Markup:
    """Return the first sentence of a certificate: how many claims hold, and which do not."""
    whole = len(certificate.holds) + len(certificate.falls_short) + len(certificate.undetermined)
    if not whole:
        return Markup("The code states no claims. Its properties were measured nevertheless.")
    said = Markup("{} of its {} claims hold").format(len(certificate.holds), whole)
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
        _order(numbers),
        Markup("energy {} up to t = {:g}, its error at most {}").format(energy(numbers), drift["t"], at_most(known(drift["largest"]))),
        *([Markup("<b>more than the kinetic energy: the motion is lost</b>")] if known(drift["size"]) > LOST else []),
        Markup("error of a coordinate {} up to t = {:g} with h = {:g}").format(number(known(error["value"])), error["t"], setting["h"]),
        *([Markup("|<i>g</i>| at most {}").format(at_most(known(conserved["g"]), 1))] if "g" in conserved else []),
    ]
    return Markup("; ").join(parts) + "."


def _order(numbers: Mapping[str, Any]) -> Markup:
    if known(numbers["orders"]["contraction"]) > FALLS:
        return Markup("<b>no convergence to the motion</b>")
    slope = order(numbers)
    return Markup("order not known") if slope == NONE else Markup("order {}").format(slope)
