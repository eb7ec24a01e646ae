"""``daebench archive``: a study in one file."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json, Overwrite, Trusted, TrustedCode
from daebench.cli.console import print_json, printable
from daebench.cli.grids import require_store
from daebench.methods.foreign import Trust
from daebench.records.store import opened
from daebench.runs.files import check_zip
from daebench.runs.outputs import described, require_own
from daebench.studies.grid.archive import write_archive


def archive(
    store: Annotated[Path, typer.Argument(help="File of the stored runs of a study, such as output/work-precision/studies.db.")],
    out: Annotated[Path | None, typer.Option("--out", help="FILE.zip to write; STORE.zip if left out.", show_default=False)] = None,
    trust: Trusted = False,
    code: TrustedCode = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Write a study into one ZIP file: its runs, problem files, certificates, pictures, and a text that says how they were made."""
    require_store(store)
    path = store.with_suffix(".zip") if out is None else out
    check_zip(path)
    require_own(path)
    about = {"Runs": f"those of {store}", "To hold it against a new run": f"daebench reproduce {path.name}"}
    with opened(store) as run_store, described([path], about):
        contents = write_archive(run_store, path, Trust.of(trust, code or ()))
    if json:
        print_json(
            {
                "file": str(path),
                "rows": contents.rows,
                "left_out": contents.changed,
                "files": list(contents.files),
                "without": list(contents.without),
            }
        )
        return
    less = f", without {contents.changed} of definitions that have changed since" if contents.changed else ""
    lacking = f", without the code of {', '.join(contents.without)}, whose runs cannot be repeated from it" if contents.without else ""
    print(printable(f"written: {path}, {contents.rows} runs{less}{lacking}; hold it against a new run by: daebench reproduce {path}"))
