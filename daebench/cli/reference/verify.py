"""``daebench reference verify``: stored references held against everything that can be known of them without heyoka."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import bar, print_json, print_table
from daebench.cli.reference.arguments import Folder, whose
from daebench.errors import BadInput

if TYPE_CHECKING:
    from daebench.reference.check.verification import Digits, Verification

METHODS = 3
"""Recomputations: ours throughout, ours from row to row, IDA."""


def verify(
    name: Annotated[str | None, typer.Argument(help="Name of a reference, PROBLEM-CASE; all if left out.", show_default=False)] = None,
    folder: Folder = None,
    as_json: Json = False,
) -> None:
    """Check checksums, definition and invariants, and recompute by a method of our own and by IDA; exit 1 if a check fails."""
    from daebench.reference.check.verify import verify as verified
    from daebench.reference.keep.store import kept_in, names

    wanted = names(folder) if name is None else (name,)
    if not wanted:
        raise BadInput(f"there are no references in {folder}; build one by: daebench reference build NAME --out {folder}.")
    with bar("verify") as progress:
        found = [verified(name, folder, progress) if name is not None else _even_damaged(each, folder, progress) for each in wanted]
    homes = {each.name: whose(kept_in(each.name, folder)) for each in found}
    ok = all(each.ok for each in found)
    if as_json:
        print_json({"ok": ok, "references": [asdict(each) | {"ok": each.ok, "kept_in": homes[each.name]} for each in found]})
    else:
        _print(found, homes)
    raise typer.Exit(0 if ok else 1)


def _even_damaged(name: str, folder: Any, progress: Any) -> "Verification":
    """Verify one of many references: where files are damaged, that is what is found, and the others are still looked at."""
    from daebench.reference.check.verification import Check, Verification
    from daebench.reference.check.verify import verify as verified
    from daebench.reference.keep.store import Damaged

    try:
        return verified(name, folder, progress)
    except Damaged as error:
        return Verification(name, (Check("files", "as they were written", str(error).rstrip("."), False),))


def _print(found: "list[Verification]", homes: Mapping[str, str]) -> None:
    for each in found:
        title = f"{each.name} of {homes[each.name]}"
        if len(found) == 1:
            print_table(["check", "expected", "found", ""], [[x.what, x.expected, x.found, _verdict(x.ok)] for x in each.checks], title)
            _print_digits(each)
            print(each.unseen)
    if len(found) > 1:
        rows = [[each.name, homes[each.name], str(len(each.checks)), *_least(each), _verdict(each.ok)] for each in found]
        print_table(["reference", "of", "checks", "digits, own method", "row to row", "IDA", "seen from", ""], rows)
    for each in found:
        for check in each.checks:
            if not check.ok:
                print(f"{each.name} fails: {check.what}: expected {check.expected}, found {check.found}.")


def _verdict(ok: bool) -> str:
    return "ok" if ok else "FAILS"


def _least(found: "Verification") -> list[str]:
    """Return the digits of agreement of the worst part by each method, and the smallest alteration that is sure to be seen."""
    if len(_by_method(found)) < METHODS:
        return [""] * (METHODS + 1)
    least = [f"{min(each.overall for each in parts):.1f}" for parts in _by_method(found)]
    return [*least, f"{min(max(each.visible for each in parts) for parts in _by_method(found)):.1e}"]


def _by_method(found: "Verification") -> "list[list[Digits]]":
    methods = dict.fromkeys(each.method for each in found.digits)
    return [[each for each in found.digits if each.method == method] for method in methods]


def _print_digits(found: "Verification") -> None:
    for parts in _by_method(found):
        columns = ["digits up to t =", *(f"{t:g}" for t, _ in parts[0].at), "an alteration is seen from"]
        rows = [[each.part, *(f"{digits:.1f}" for _, digits in each.at), f"{each.visible:.1e}"] for each in parts]
        print_table(columns, rows, parts[0].method)
