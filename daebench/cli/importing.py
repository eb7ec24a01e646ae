"""``daebench import``: a model file of MuJoCo as a problem file."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json, Overwrite
from daebench.cli.console import print_json, printable
from daebench.errors import BadInput
from daebench.runs.files import atomic, check_place
from daebench.runs.outputs import described


def importing(
    model: Annotated[Path, typer.Argument(help="MJCF or URDF file, such as arm.xml.")],
    out: Annotated[Path, typer.Option("--out", help="FILE.py to write.")],
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Import a model of MuJoCo, MJCF or URDF, as a Python file with its mechanism: bodies, joints and hard constraints."""
    from daebench.joints.models.read import read_model  # which imports SymPy, and the help does not

    if out.suffix != ".py":
        raise BadInput(f"{out}: the file must end in .py.", "import-not-to-py")
    check_place(out)
    read = read_model(model)
    with described([out], {"Model": str(model)}), atomic(out) as scratch:
        scratch.write_text(read.text, encoding="utf-8")
    mechanism = read.mechanism
    if json:
        about = {
            "file": str(out),
            "bodies": [*mechanism.bodies],
            "cases": [*mechanism.cases],
            "parameters": [*map(str, mechanism.parameters)],
        }
        print_json(about | {"left_out": dict(read.left_out), "remarks": [*read.remarks]})
        return
    print(printable(f"written: {out}, {len(mechanism.bodies)} bodies; cases: {', '.join(mechanism.cases)}."))
