"""``daebench reference show``: the certificate of one reference as text."""

from collections.abc import Mapping
from typing import Any

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.cli.reference.arguments import Folder, Name, whose
from daebench.reference.keep.store import kept_in, load

LONGEST = 600
"""Largest number of printed characters of an entry of the definition."""


def show(name: Name, folder: Folder = None, as_json: Json = False) -> None:
    """Show the certificate of a reference: definition, checks, horizons, drifts, rank, and the accuracy of IDA on it."""
    reference, home = load(name, folder), whose(kept_in(name, folder))
    certificate = reference.certificate
    if as_json:
        print_json({**certificate, "kept_in": home})
        return
    print(f"{name}: {certificate['about']}\n")
    definition = {key: value for key, value in certificate["definition"].items() if value}
    print_table(["", ""], [[key, _text(value)] for key, value in definition.items()], "definition")
    print_table(["", ""], [["kept in", home], *_facts(reference)], "what is known")
    parts = reference.state.stored
    checks = [
        [str(check["against"]), *(f"{check['largest_difference'][part]:.2g}" for part in parts)] for check in certificate["made"]["checks"]
    ]
    print_table(["held against", *(f"max |d{part}|" for part in parts)], checks, "checks")
    columns = ["method", "tol", f"|d{parts[0]}|", "estimated", "lost at", "steps", "calls", "status"]
    ida = certificate["ida"]
    if ida:
        print_table(columns, [_ida(row, parts[0]) for row in ida], f"what IDA reaches by t = {ida[0]['t_end']:g}")


def _facts(reference: Any) -> list[list[str]]:
    certificate, horizon = reference.certificate, reference.certificate["horizon"]
    largest = [f"{part} {rows[-1].max():.2g}" for part, rows in reference.bound.items()]
    return [
        ["truth", certificate["made"]["method"]],
        ["rows", f"{len(reference.t)} from t = 0 to {reference.horizon:g}"],
        ["bound at the end", ", ".join(largest)],
        ["horizon of the truth", f"{horizon['truth']:g}" + (" (as far as requested)" if horizon["truth"] == horizon["asked"] else "")],
        ["horizon of double precision", "beyond the end" if horizon["double"] is None else f"{horizon['double']:g}"],
        ["amplification", f"{certificate['amplification']['largest']:g} at most"],
        ["drift", ", ".join(f"{name} {value:.2g}" for name, value in certificate["drift"].items())],
        *_rank(certificate),
        ["made by", certificate["made"]["by"]],
        ["versions", ", ".join(f"{name} {number}" for name, number in certificate["versions"].items())],
    ]


def _rank(certificate: Mapping[str, Any]) -> list[list[str]]:
    """Return the row on the rank of G, which constrained problems have."""
    if "rank" not in certificate:
        return []
    rank = certificate["rank"]
    least = f"{rank['smallest_singular_value']:g} at t = {rank['t']:g}; largest {rank['largest']:g}"
    losses = ", ".join(f"{t:.6g}" for t in rank.get("lost", ()))
    passed = [["rank of G lost at t =", f"{losses}; the reference solution is in minimal coordinates"]] if losses else []
    return [["smallest singular value of G M^-1 G^T", least], *passed]


def _text(value: Any) -> str:
    """Return an entry of the definition as text, or its beginning if it is very long."""
    text = _whole(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}... ({len(text)} characters, which --json has)"


def _whole(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {entry}" for key, entry in value.items())
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _ida(row: Mapping[str, Any], lead: str) -> list[str]:
    estimate = "none" if row["estimate"] is None else f"{row['estimate'][lead]:.2g}"
    lost = "" if row["lost"] is None else f"t = {row['lost']:g}"
    accuracy = [f"{row['tol']:g}", f"{row['error'][lead]:.2g}", estimate, lost]
    return [str(row["method"]), *accuracy, str(row["steps"]), str(row["residuals"]), str(row["status"])]
