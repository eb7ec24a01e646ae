"""Tutorials as notebooks: they are valid, have the cells of their pages and no link that leads nowhere, and run; their texts hold."""

import json
import re
import subprocess
import sys

import nbformat
import pytest
from daebench_site.notebooks import names, of_tutorial
from said import DOCS

NAMES = names(DOCS)


def made(name):
    return json.loads(of_tutorial((DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")))


def code(name):
    return ["".join(cell["source"]) for cell in made(name)["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize("name", NAMES)
def test_a_tutorial_becomes_a_valid_notebook_with_all_its_cells(name):
    text = (DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    nbformat.validate(nbformat.from_dict(made(name)))
    assert len(code(name)) == text.count("{code-cell} python")
    prose = "".join("".join(cell["source"]) for cell in made(name)["cells"] if cell["cell_type"] == "markdown")
    assert prose.startswith("# ")
    assert not re.search(r"code-cell|kernelspec|\]\((?!https?:)|^:tags:", prose, re.MULTILINE)


SAID = {
    "mechanism": """
assert abs(force.max() - 735.75) < 0.1
assert abs(run.maxima["energy"] / finer.maxima["energy"] - 4) < 0.01
verdicts = dict(zip(compared["method"], compared["energy_verdict"]))
assert verdicts["rattle"] == "bounded" and verdicts["rk4"] == "drifts", verdicts
most = table.groupby(["joint", "on"])["force"].max()
assert 3 < most["joint O", "door"] / force.max() < 3.3 and most.idxmax() == ("joint C", "lever")
""",
    "fault": """
assert diagnosis.verdict == "correct"
first = daebench.diagnose(step, problem=bead)
assert (first.verdict, first.faults) == ("fault", ("reference_gradient_each_sweep",))
wrong = daebench.compare(bead, methods=[step, "rattle"], h=0.01, t_end=40)
assert list(wrong["energy_verdict"]) == ["drifts", "bounded"] and wrong[["g", "Gv"]].to_numpy().max() < 1e-13
assert abs(table["position_error"][0] / table["position_error"][1] - 1) < 1e-3
""",
    "first-problem": "assert 3.9 < run.maxima['energy'] / finer.maxima['energy'] < 4.1",
    "figure-1-1": "assert table.set_index('method')['energy_error'].idxmin() == 'rattle'",
    "certify": "assert any('symplectic' in claim for claim in certificate.falls_short)",
    "ensemble": "assert swings.q.shape == (101, 256, 4)",
}
"""What the tutorials say of their runs, held against the names of their cells."""


@pytest.mark.slow
@pytest.mark.sampled(left_out=("certify", "ensemble", "fault", "mechanism"))
@pytest.mark.parametrize("name", NAMES)
def test_the_cells_of_a_tutorial_run_one_after_the_other_and_its_text_holds(name, tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    script = tmp_path / "cells.py"  # certify and diagnose read the text of functions
    script.write_text("\n".join([*code(name), SAID[name]]), encoding="utf-8")
    subprocess.run([sys.executable, str(script)], check=True, cwd=tmp_path)
