"""``daebench export``: the runs of a store as one table."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json, Overwrite
from daebench.cli.console import print_json
from daebench.cli.grids import require_store
from daebench.records.code import code_version
from daebench.records.store import opened
from daebench.runs.outputs import described, require_own
from daebench.studies.grid import export as tables


def export(
    store: Annotated[Path, typer.Argument(help="File of the stored runs of a study, such as output/work-precision/studies.db.")],
    file: Annotated[Path, typer.Argument(help="FILE.csv or FILE.parquet to write.")],
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Write all runs of a store as one table, one row per run, with its provenance and time; CSV, or Parquet (extra scale)."""
    require_store(store)
    tables.check_file(file)
    require_own(file, "")
    with opened(store) as run_store:
        table = tables.table_of(run_store)
    with described([file], tables.described(table)):
        tables.write(table, file)
    others = int((table["maker"] != code_version()).sum())
    if json:
        print_json({"file": str(file), "rows": len(table), "columns": list(table.columns), "of_other_versions": others})
        return
    remark = f", {others} of them made by other versions of daebench or of a library" if others else ""
    print(f"written: {file}, {len(table)} rows{remark}.")
