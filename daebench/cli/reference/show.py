"""``daebench reference show``: the certificate of one reference, for people."""

from collections.abc import Mapping
from typing import Any

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.cli.reference.arguments import Folder, Name, place


def show(name: Name, folder: Folder = None, as_json: Json = False) -> None:
    """Show what is known of a reference: definition, checks, horizons, drifts, rank, and what IDA reaches on it."""
    from daebench.reference.certified.store import load

    found = load(name, place(folder))
    certificate = found.certificate
    if as_json:
        print_json(certificate)
        return
    print(f"{name}: {certificate['about']}\n")
    definition = {key: value for key, value in certificate["definition"].items() if value}
    print_table(["", ""], [[key, _text(value)] for key, value in definition.items()], "definition")
    print_table(["", ""], list(_facts(found)), "what is known")
    checks = certificate["made"]["checks"]
    print_table(
        ["held against", "max |dq|", "max |dp|", "max |dlam|"], [[str(each["against"]), *_differences(each)] for each in checks], "checks"
    )
    columns = ["method", "tol", "|dq|", "estimated", "lost at", "steps", "calls", "status"]
    print_table(columns, [_ida(each) for each in certificate["ida"]], f"what IDA reaches by t = {certificate['ida'][0]['t_end']:g}")


def _facts(found: Any) -> list[list[str]]:
    certificate, horizon = found.certificate, found.certificate["horizon"]
    rank = certificate["rank"]
    largest = [f"{part} {rows[-1].max():.2g}" for part, rows in found.bound.items()]
    return [
        ["truth", certificate["made"]["method"]],
        ["rows", f"{len(found.t)} from t = 0 to {found.horizon:g}"],
        ["bound at the end", ", ".join(largest)],
        ["horizon of the truth", f"{horizon['truth']:g}" + (" (as far as was asked)" if horizon["truth"] == horizon["asked"] else "")],
        ["horizon of double precision", "beyond the end" if horizon["double"] is None else f"{horizon['double']:g}"],
        ["amplification", f"{certificate['amplification']['largest']:g} at most"],
        ["drift", ", ".join(f"{name} {value:.2g}" for name, value in certificate["drift"].items())],
        ["smallest singular value of G M^-1 G^T", f"{rank['smallest_singular_value']:g} at t = {rank['t']:g}; largest {rank['largest']:g}"],
        ["made by", certificate["made"]["by"]],
        ["versions", ", ".join(f"{name} {number}" for name, number in certificate["versions"].items())],
    ]


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {each}" for key, each in value.items())
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _differences(check: Mapping[str, Any]) -> list[str]:
    return [f"{check['largest_difference'][part]:.2g}" for part in ("q", "p", "lam")]


def _ida(row: Mapping[str, Any]) -> list[str]:
    estimate = "none" if row["estimate"] is None else f"{row['estimate']['q']:.2g}"
    lost = "" if row["lost"] is None else f"t = {row['lost']:g}"
    accuracy = [f"{row['tol']:g}", f"{row['error']['q']:.2g}", estimate, lost]
    return [str(row["method"]), *accuracy, str(row["steps"]), str(row["residuals"]), str(row["status"])]
