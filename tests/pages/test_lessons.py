"""Lessons: what their notebooks compute, what their texts rest on, and the pages made of them."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pages import standalone
from PIL import Image

from daebench.methods.catalogue import lessons
from daebench.pages.lesson.film import Control, Shown, film
from daebench.pages.lesson.formula import formula
from daebench.pages.lesson.notebook import notebook
from daebench.pages.lesson.page import export
from daebench.pages.report.claims import ClaimRefuted
from daebench.reports.index_reduction.two_motions import Run
from daebench.reports.lessons.why_symplectic import check_pendulum, check_torus

ROOT = Path(__file__).parents[2]
EVERY = sorted(lessons())


def test_formulas_become_mathml_with_their_numbers():
    found = formula(r"y = x^2 \tag{HLW VI.2}", display=True)
    assert ("<msup>" in found, "(HLW VI.2)</span>" in found, "tag" in formula("x^2 < 1")) == (True, True, False)


def test_blocks_of_python_become_cells():
    made = json.loads(notebook("# A title\n\nText.\n\n```python\na = 1\na\n```\n\nMore.\n"))
    assert [cell["cell_type"] for cell in made["cells"]] == ["markdown", "code", "markdown"]
    assert "".join(made["cells"][1]["source"]) == "a = 1\na"
    assert made["nbformat"] == 4


SAID = {
    "why-symplectic": """
table = daebench.compare("spherical_pendulum", case="fig1.1", methods=methods, h=0.03, t_end=15).set_index("method")
assert table["g"]["se+proj"] < 1e-14 and table["energy_error"]["se+proj"] > 10 * table["energy_error"]["rattle"]
assert abs(table["energy_error"]["midpoint"] / table["energy_error"]["rattle"] - 1) < 0.01
table = daebench.compare("torus", methods=["rattle", "gauss2"], h=0.1, t_end=2000).set_index("method")
assert table["energy_error"]["gauss2"] > 5 * table["energy_error"]["rattle"]
""",
    "shake-to-lobatto": """
assert np.abs(shake.q - rattle.q).max() < 1e-11 and np.abs(shake.p - rattle.p).max() > 1e-5
assert np.abs(shake.p - along * shake.q - rattle.p).max() < 1e-10
""",
    "tolerance": """
estimate, error = np.abs(loose.q - tight.q).max(), np.abs(loose.q - finest.q).max()
assert 0.5 * error < estimate < 2 * error
""",
    "poisson-maps": """
changed = {}
for method in ("strang", "rk4"):
    runs = [daebench.run("lotka_volterra", method=method, h=0.25, t_end=2.5, y0=start, anyway=True) for start in starts]
    changed[method] = abs(area(np.array([run.y[-1] for run in runs])) / area(starts) - 1)
assert changed["strang"] < 1e-5 and changed["rk4"] > 1e-3, changed
""",
    "nonholonomic": """
verdicts = {}
for case, table in (("even", even), ("uneven", uneven), ("swinging", swinging)):
    verdicts[case] = dict(zip(table["method"], table["energy_verdict"]))
for case in ("even", "swinging"):
    assert {name for name, verdict in verdicts[case].items() if verdict == "bounded"} == {"dla", "spark_lobatto3", "gni"}, verdicts
lost = dict(zip(uneven["method"], uneven["energy_error"]))
assert lost["gni"] < 0.15 < 0.9 < lost["dla"] and verdicts["uneven"]["dla"] == verdicts["uneven"]["spark_lobatto3"] == "drifts"
""",
    "extremes": """
assert "loses rank" in run.failure
""",
}
"""What the texts of notebooks say of their runs, held against these; the names are those of the cells."""


@pytest.mark.slow
@pytest.mark.sampled(by=("extremes", "tolerance").__contains__)
@pytest.mark.parametrize("name", EVERY)
def test_the_cells_of_a_notebook_run_one_after_the_other_and_their_texts_hold(name, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    text = (ROOT / "reports" / "lessons" / f"{name.replace('-', '_')}.md").read_text(encoding="utf-8")
    cells = ["".join(cell["source"]) for cell in json.loads(notebook(text))["cells"] if cell["cell_type"] == "code"]
    assert len(cells) >= 3
    subprocess.run([sys.executable, "-c", "\n".join([*cells, SAID[name]])], check=True, cwd=ROOT)


def test_a_film_has_a_frame_for_each_setting_and_shows_the_default_first():
    controls = (
        Control("name", "a name", {"a": "first", "b": "second"}, "b"),
        Control("x", "x [m]", {0.1: "0.1", 0.2: "0.2", 0.3: "0.3"}, 0.2),
    )
    told = []
    text = film(
        "it", "About it", controls, lambda values: Shown(f"<svg>{values['x']}", f"{values['name']}!"), lambda *now: told.append(now[0])
    )
    assert re.findall(r'data-frame="([^"]*)"><p class="says">(\w)!', text) == [
        (f"{i}-{k}", name) for i, name in enumerate("ab") for k in range(3)
    ]
    assert re.search(r'aria-live="polite">b!</p><div[^>]*>&lt;svg&gt;0.2', text)
    assert (text.count("<fieldset"), text.count('type="range"')) == (1, 1)
    assert told == sorted(told)
    assert told[-1] == 1


def long_run(level, end, *, g=0.0, failure=None, power=1):
    """Return a run whose energy error oscillates at a level, and grows by a power of the time to another one at the end."""
    t = np.linspace(0.0, 1000.0, 20001)
    error = level * np.cos(7 * t) + (end - level) * (t / t[-1]) ** power
    return Run(t, np.zeros((len(t), 3)), error, g, failure)


TORUS = {
    "rattle": long_run(1e-2, 1e-2),
    "lobatto3": long_run(1e-5, 1e-5),
    "canonical:gauss2": long_run(1e-6, 1e-6),
    "local:gauss2": long_run(1e-6, 1e-3),
    "gauss2": long_run(1e-6, 1.0, g=0.1, power=2),
    "rk4": long_run(1e-3, 1.0, failure="it stopped"),
}
PENDULUM = {
    **{name: long_run(1e-4, 1e-4, g=g) for name, g in (("rattle", 0.0), ("midpoint", 1e-3), ("gauss2", 1e-8))},
    **{name: long_run(1e-3, 1.0, failure="it stopped") for name in ("se", "rk4")},
}
FALSE_TORUS = {
    "rattle drifts": {"rattle": long_run(1e-2, 0.1)},
    "lobatto3 drifts": {"lobatto3": long_run(1e-5, 1e-4)},
    "canonical drifts": {"canonical:gauss2": long_run(1e-6, 1e-4)},
    "gauss2 is level": {"gauss2": TORUS["canonical:gauss2"]},
    "gauss2 stays below rattle": {"gauss2": long_run(1e-6, 1e-3, g=0.1, power=2)},
    "gauss2 stops": {"gauss2": long_run(1e-6, 1.0, g=0.1, failure="it stopped", power=2)},
    "gauss2 stays on the torus": {"gauss2": long_run(1e-6, 1.0, power=2)},
    "local is level": {"local:gauss2": TORUS["canonical:gauss2"]},
    "local grows like a square": {"local:gauss2": long_run(1e-6, 1e-3, power=2)},
    "rk4 reaches the end": {"rk4": long_run(1e-3, 1.0)},
}
FALSE_PENDULUM = {
    "midpoint drifts": {"midpoint": long_run(1e-4, 1e-2, g=1e-3)},
    "midpoint is twice as bad": {"midpoint": long_run(2e-4, 2e-4, g=1e-3)},
    "midpoint keeps the rod": {"midpoint": long_run(1e-4, 1e-4)},
    "gauss2 drifts": {"gauss2": long_run(1e-8, 1e-6, g=1e-8)},
    "se reaches the end": {"se": long_run(1e-3, 1.0)},
}


STORIES = {name: (check_torus, TORUS, changed) for name, changed in FALSE_TORUS.items()}
STORIES |= {name: (check_pendulum, PENDULUM, changed) for name, changed in FALSE_PENDULUM.items()}


@pytest.mark.parametrize(("check", "runs", "changed"), STORIES.values(), ids=STORIES)
def test_the_first_lesson_is_not_written_if_its_motions_say_something_else(check, runs, changed):
    check(runs)
    with pytest.raises(ClaimRefuted):
        check(runs | changed)


def test_without_what_formulas_need_there_is_a_sentence_that_says_what_to_install(daebench, monkeypatch, tmp_path):
    monkeypatch.setattr("daebench.pages.lesson.installed.find_spec", lambda name: None)
    assert (daebench("lesson", EVERY[0], "--no-browser", "--export", tmp_path)[0], daebench.error.code) == (2, "lesson-packages-missing")


def test_lessons_are_listed_and_listing_imports_nothing_heavy(daebench):
    assert all(name in daebench("lesson")[1] for name in EVERY)
    code = "import sys; sys.argv[1:] = ['list', 'lessons']; from daebench.cli.app import main\n"
    code += "try: main()\nexcept SystemExit: pass\nprint([name for name in ('numpy', 'pandas', 'sympy') if name in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert said.strip().endswith("[]")


@pytest.mark.slow
@pytest.mark.sampled(by=("extremes", "shake-to-lobatto").__contains__)
@pytest.mark.parametrize("name", EVERY)
def test_a_page_stands_alone(name, tmp_path):
    told = []
    page = export(name, tmp_path / name, lambda fraction, doing: told.append(fraction))
    text = page.read_text(encoding="utf-8")
    (tmp_path / "index.html").touch()  # the gallery, which the page leads back to
    standalone(page, quotes=True)
    assert ("<math" in text, text.count("<details>") >= 3, "<details open" in text) == (True, True, False)
    assert json.loads((page.parent / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    assert told == sorted(told)
    with Image.open(page.parent / "figures" / "thumbnail.png") as thumbnail:
        assert thumbnail.width > 500
        assert np.ptp(np.asarray(thumbnail.convert("L"))) > 200
    tables = list(page.parent.glob("*.csv"))
    assert [len(text.encode()) < (2_500_000 if tables else 300_000), bool(tables)] == [True, name == "tolerance"]
    assert all(f'id="film-{table.stem}"' in text for table in tables)
