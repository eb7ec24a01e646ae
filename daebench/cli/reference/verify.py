"""``daebench reference verify``: checks of stored references that do not need heyoka."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Annotated, Any

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import bar, print_json, print_table
from daebench.cli.reference.arguments import Folder, whose
from daebench.errors import BadInput
from daebench.reference.check.recomputation import Check, Digits, Verification
from daebench.reference.keep.store import Damaged, kept_in, names

METHODS = 3
"""Recomputations: by daebench over the whole time, by daebench from row to row, by IDA."""


def verify(
    name: Annotated[str | None, typer.Argument(help="Name of a reference, PROBLEM-CASE; all if left out.", show_default=False)] = None,
    folder: Folder = None,
    as_json: Json = False,
) -> None:
    """Check checksums, definition and invariants, and recompute by another method of daebench and by IDA; exit 1 if a check fails."""
    wanted = names(folder) if name is None else (name,)
    if not wanted:
        raise BadInput(
            f"there are no references in {folder}; build one by: daebench reference build NAME --out {folder}.", "no-references-in-folder"
        )
    from daebench.reference.check.verify import verify as verified

    with bar("verify") as progress:
        verifications = [
            verified(name, folder, progress) if name is not None else _even_damaged(reference_name, folder, progress)
            for reference_name in wanted
        ]
    homes = {verification.name: whose(kept_in(verification.name, folder)) for verification in verifications}
    ok = all(verification.ok for verification in verifications)
    if as_json:
        print_json(
            {
                "ok": ok,
                "references": [
                    asdict(verification) | {"ok": verification.ok, "kept_in": homes[verification.name]} for verification in verifications
                ],
            }
        )
    else:
        _print(verifications, homes)
    raise typer.Exit(0 if ok else 1)


def _even_damaged(name: str, folder: Any, progress: Any) -> Verification:
    """Verify one of many references: damaged files are reported, and the other references are still verified."""
    from daebench.reference.check.verify import verify as verified

    try:
        return verified(name, folder, progress, asked=False)
    except Damaged as error:
        return Verification(name, (Check("files", "as they were written", str(error).rstrip("."), False),))


def _print(verifications: list[Verification], homes: Mapping[str, str]) -> None:
    for verification in verifications:
        title = f"{verification.name} of {homes[verification.name]}"
        if len(verifications) == 1:
            print_table(
                ["check", "expected", "found", ""], [[x.what, x.expected, x.found, _verdict(x.ok)] for x in verification.checks], title
            )
            _print_digits(verification)
            print(verification.unseen)
    if len(verifications) > 1:
        rows = [
            [outcome.name, homes[outcome.name], str(len(outcome.checks)), *_least(outcome), _verdict(outcome.ok)]
            for outcome in verifications
        ]
        print_table(["reference", "of", "checks", "digits, own method", "row to row", "IDA", "seen from", ""], rows)
    for verification in verifications:
        for check in verification.checks:
            if not check.ok:
                print(f"{verification.name} fails: {check.what}: expected {check.expected}, found {check.found}.")


def _verdict(ok: bool) -> str:
    return "ok" if ok else "FAILS"


def _least(verification: Verification) -> list[str]:
    """Return the digits of agreement of the worst part by each method, and the smallest alteration that is certainly detected."""
    if len(_by_method(verification)) < METHODS:
        return [""] * (METHODS + 1)
    least = [f"{min(agreement.overall for agreement in parts):.1f}" for parts in _by_method(verification)]
    return [*least, f"{min(max(agreement.visible for agreement in parts) for parts in _by_method(verification)):.1e}"]


def _by_method(verification: Verification) -> list[list[Digits]]:
    methods = dict.fromkeys(agreement.method for agreement in verification.digits)
    return [[agreement for agreement in verification.digits if agreement.method == method] for method in methods]


def _print_digits(verification: Verification) -> None:
    for parts in _by_method(verification):
        columns = ["digits up to t =", *(f"{t:g}" for t, _ in parts[0].at), "smallest detectable change"]
        rows = [[agreement.part, *(f"{digits:.1f}" for _, digits in agreement.at), f"{agreement.visible:.1e}"] for agreement in parts]
        print_table(columns, rows, parts[0].method)
