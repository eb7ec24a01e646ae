"""Every command that runs methods takes --on-singular and --anyway where it can meet them, and the choice reaches the runs."""

import contextlib
import json
import math

import contestants
import pytest
import typer
from questions import COARSE, SHOWN, WORDS, alike
from refusals import refused

import daebench as package
from daebench.cli.app import app
from daebench.records.seals import checksum
from daebench.studies.certificate import process

BEAD = '''"""A bead on a circle."""

import sympy as sp

from daebench import Case, ConstrainedHamiltonian, Picture


def problem() -> ConstrainedHamiltonian:
    x, y = q = sp.symbols("x y", real=True)
    circle = (x**2 + y**2 - 1) / 2
    return ConstrainedHamiltonian(
        q=q,
        p=sp.symbols("p_x p_y", real=True),
        M=sp.eye(2),
        U=y,
        g=[CONSTRAINTS],
        cases={"swing": Case(q=(0, -1), p=(1, 0))},
        picture=Picture(rods=[[(0, 0), (x, y)]]),
    )
'''
ONCE, TWICE = "once.py", "twice.py"
FILES = {ONCE: BEAD.replace("CONSTRAINTS", "circle"), TWICE: BEAD.replace("CONSTRAINTS", "circle, 2 * circle")}
"""The same motion with a constraint, and with one more that is redundant."""

CROSS = '''"""A bead on two lines that cross, where G loses rank: it comes along one of them, against a force, at rest after 2 s."""

import sympy as sp

from daebench import Case, ConstrainedHamiltonian


def problem() -> ConstrainedHamiltonian:
    x, y = q = sp.symbols("x y", real=True)
    case = Case(q=(-1, 0), p=(2, 0))
    return ConstrainedHamiltonian(q=q, p=sp.symbols("p_x p_y", real=True), M=sp.eye(2), U=x, g=[x * y], cases={"along": case})
'''
WITHOUT = {"--anyway": {"tolerance-for", "shadow", "baumgarte", "modes", "diagnose"}, "--on-singular": {"diagnose"}}
"""Commands that take methods and not an option: they are for constrained systems, or compare single steps, of which none is watched."""


@pytest.fixture
def ask(daebench, tmp_path, monkeypatch):
    """Return a function that calls a command on a problem with a method: it gives exit status, JSON or None, and all that is printed."""
    monkeypatch.chdir(tmp_path)
    for name, text in (FILES | {"cross.py": CROSS}).items():
        (tmp_path / name).write_text(text)
    monkeypatch.setattr("daebench.cli.bench.first_step", lambda *_, **__: (1.0, 0.5))
    monkeypatch.setattr("daebench.cli.bench.numpy_alone", lambda **_: 0.25)
    monkeypatch.setattr(process, "measured", in_this_process)

    def call(command, problem, *more, method="rattle"):
        names = {"PROBLEM": problem, "METHOD": method}
        folder = tmp_path / "-".join((command, *more)) if command == "long" else tmp_path / command  # long refuses runs of another choice
        folder.mkdir(exist_ok=True)
        words = [names.get(word, word.replace("OUT", str(folder))) for word in WORDS[command]]
        as_json = () if command == "animate" else ("--json",)
        status, out, err = daebench(command, *words, *more, *as_json)
        return status, json.loads(out) if out and as_json else None, out + err

    return call


def in_this_process(tasks, folder, *_):
    with contextlib.chdir(folder):
        return [process.answer(json.loads(json.dumps(task))) for task in tasks]


STOPPED = {"ensemble": "G loses rank", "chaos": "singular matrix", "step-for": "G loses rank"}
"""What is said of members that stop, and of a scheme whose runs are tables; other commands name the redundant constraint, g2."""


GATE = ("run", "order", "ensemble", "work-precision", "long", "compare", "shadow")
"""A run, a study of one, members, a store of runs, pieces of runs, several methods, and sizes of steps: the gate takes these."""

ON_THE_WAY = ("run", "compare", "long", "bench", "shadow", "precision", "advise", "stability")
"""Commands that are asked of a loss of rank on the way, which shows as well that the choice reaches their runs."""


def rounds(command):
    """Return how often a command is asked: again, with the runs that are stored, where a store is."""
    return range(2 if command == "work-precision" else 1)


@pytest.mark.sampled(by=lambda case: case == "run" or (case in GATE and case not in (*ON_THE_WAY, "work-precision")))
@pytest.mark.parametrize("command", [name for name in WORDS if name != "animate"], ids=str)
def test_redundant_constraints_stop_or_are_solved_by_least_squares_and_then_move_as_without_them(ask, request, command):
    if command != "chaos":
        request.getfixturevalue("uncompiled_schemes")
        request.getfixturevalue("plain_functions")
    status, once, _ = ask(command, ONCE)
    expected = SHOWN[command](once)
    for _ in rounds(command):  # with the runs that are stored, and then with those of the other choice beside them
        solved, twice, _ = ask(command, TWICE, "--on-singular", "least-squares")
        assert solved == status
        assert alike(SHOWN[command](twice), expected, COARSE.get(command, 1e-6))
        _, _, said = ask(command, TWICE, "--on-singular", "stop")
        assert STOPPED.get(command, "g2") in said


@pytest.mark.usefixtures("uncompiled_schemes", "plain_functions")
def test_an_animation_stops_or_goes_on(ask):
    assert "g2" in ask("animate", TWICE, "--on-singular", "stop")[2]
    assert ask("animate", TWICE, "--on-singular", "least-squares")[0] == 0


@pytest.mark.usefixtures("uncompiled_schemes", "plain_functions")
@pytest.mark.sampled(by=lambda case: case in GATE, slow=("long",))
@pytest.mark.parametrize("command", ON_THE_WAY)
def test_where_G_loses_rank_on_the_way_a_run_stops_or_goes_through(ask, command):
    _, _, said = ask(command, "cross.py", "--on-singular", "stop")
    assert "t = 0.5" in said  # 2 - sqrt(2), foreseen half a step before
    status, shown, said = ask(command, "cross.py", "--on-singular", "continue")
    assert status == 0
    assert "rank" not in said
    if command == "run":
        assert SHOWN[command](shown) == pytest.approx([-1 + 2 * 1.98 - 1.98**2 / 2, 0, 2 - 1.98, 0], abs=1e-12)
    if command == "advise":
        assert ("--on-singular continue" in shown["command"], "on_singular='continue'" in shown["python"]) == (True, True)


def midpoint(u, v, h, steps):
    """Return the states of predator and prey by the implicit midpoint rule, by iteration of its equation."""
    states = [(u, v)]
    for _ in range(steps):
        (u, v), (x, y) = states[-1], states[-1]
        for _ in range(200):
            a, b = (u + x) / 2, (v + y) / 2
            x, y = u + h * a * (b - 2), v + h * b * (1 - a)
        states.append((x, y))
    return states


def energy(u, v):
    return u - math.log(u) + v - 2 * math.log(v)


ANYWAY = [name for name in WORDS if name not in WITHOUT["--anyway"]]


@pytest.mark.sampled(by=lambda case: case not in ("certify", "precision", "stability", "work-precision"), slow=("long",))
@pytest.mark.parametrize("command", ANYWAY, ids=str)
def test_a_scheme_is_refused_where_it_is_no_Poisson_integrator_and_run_anyway(ask, request, command):
    if command != "chaos":
        request.getfixturevalue("uncompiled_poisson_schemes")
    system = "lotka_volterra:4,2" if command == "certify" else "lotka_volterra"
    for _ in rounds(command):
        status, shown, said = ask(command, system, method="midpoint")
        assert said.count("--anyway runs it") == 1
        assert status == 2 or (command == "bench" and "ns_per_step" not in shown["rows"][0])
        status, shown, said = ask(command, system, "--anyway", method="midpoint")
        assert (status, "--anyway runs it" in said) == (0, False)
    states = midpoint(4.0, 2.0, 0.11, 18)
    largest = max(abs(energy(*state) - energy(4.0, 2.0)) for state in states)
    if command == "run":
        assert shown["y"] == pytest.approx(states[-1], rel=1e-12)
    if command in ("compare", "precision"):
        assert SHOWN[command](shown)[0] == pytest.approx(largest, rel=1e-9)
    if command == "order":
        assert SHOWN[command](shown)["y"] == pytest.approx(2, abs=0.1)
    if command == "advise":
        assert ("--anyway" in shown["command"], "anyway=True" in shown["python"]) == (True, True)


def commands():
    """Return each command that takes methods, with the names of its options."""
    top = typer.main.get_command(app)
    options = {name: {option for one in command.params for option in one.opts} for name, command in top.commands.items()}
    return {name: known for name, known in options.items() if {"--method", "--methods", "method"} & known}


def test_every_command_that_takes_methods_takes_both_options_or_has_a_reason(ask):
    assert set(commands()) == {*WORDS, "diagnose"}
    for option, without in WITHOUT.items():
        assert {name for name, known in commands().items() if option not in known} == without
    for command in WITHOUT["--anyway"] - {"diagnose"}:
        assert ask(command, "lotka_volterra")[0] == 2, command


def test_diagnose_refuses_redundant_constraints(ask, daebench):
    assert daebench("diagnose", f"{__file__}:energy", "--problem", TWICE)[0] == 2
    assert daebench.error.code == "diagnose-faults-unknown"


RUN = {"h": 0.1, "t_end": 1}
ASKED = {
    "order": {"methods": ["rattle"]},
    "check": {"method": "rattle"},
    "step_for": {"method": "rattle", "statistic": "H", "margin": 0.1} | RUN,
    "tolerance_for": {"drift": 0.1} | RUN,
    "run": {"method": "rattle"} | RUN,
    "compare": {"methods": ["rattle"]} | RUN,
    "advise": {"methods": ["rattle"], "accuracy": 0.1, "t_end": 1},
    "shadow": {"method": "rattle"} | RUN,
    "baumgarte": {},
    "modes": {},
    "chaos": {"method": "rattle"} | RUN,
}
"""Functions of Python, and what they are asked."""


def test_functions_and_commands_know_the_choices(ask, daebench):
    for function, asked in ASKED.items():
        with refused("unknown-name", name="never"):
            getattr(package, function)("planar_pendulum", **asked, on_singular="never")
    for command in WORDS.keys() - {"animate"}:
        status, shown, _ = ask(command, "planar_pendulum", "--on-singular", "never")
        assert (status, shown, daebench.error.code) == (2, None, "unknown-name"), command


@pytest.mark.slow
@pytest.mark.usefixtures("uncompiled_schemes", "plain_functions")
def test_a_certificate_records_the_choice(ask, tmp_path, monkeypatch):
    contestants.measure_briefly(monkeypatch)
    _, made, _ = ask("certify", TWICE, "--on-singular", "least-squares")
    assert made["on_singular"] == "least-squares"
    assert "--on-singular least-squares" in (tmp_path / "certify" / "index.html").read_text()
    assert package.verify_certificate(tmp_path / "certify", trust=True).agrees


@pytest.mark.exhaustive
@pytest.mark.usefixtures("uncompiled_schemes", "plain_functions")
def test_a_certificate_without_a_choice_is_read(ask, tmp_path, monkeypatch):
    contestants.measure_briefly(monkeypatch)
    ask("certify", ONCE)
    path = tmp_path / "certify" / "certificate.json"
    old = {key: value for key, value in json.loads(path.read_text()).items() if key not in ("on_singular", "checksum")}
    path.write_text(json.dumps(old | {"checksum": checksum(old)}))
    assert package.verify_certificate(tmp_path / "certify", trust=True).agrees
