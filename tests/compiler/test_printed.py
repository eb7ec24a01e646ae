"""Functions of problems as code of other languages: what is printed is run there, and agrees with what daebench itself computes."""

import ctypes
import json
import shutil
import subprocess

import numpy as np
import pytest
import sympy as sp
from measures import differences
from refusals import refused

from daebench.compiler.printed import LANGUAGES, functions, printed
from daebench.methods import catalogue
from daebench.methods.initial_value_problem import initial_value_problem

GATE = ("double_pendulum", "driven_slider_crank", "free_rigid_body", "kepler", "knife_edge")
"""Problems of each kind; the others are swept before a release."""

PROBLEMS = sorted(set(catalogue.problems()) - {"ablowitz_ladik"})
POINTS = 3


def points(ivp):
    """Return states off the start, by the names of their vectors."""
    random = np.random.default_rng(7)
    names = ("p", "q") if len(ivp.start) == 2 else ("y",)
    for _ in range(POINTS):
        yield {name: vector * (1 + 0.1 * random.random(len(vector))) + 0.01 for name, vector in zip(names, ivp.start, strict=True)}


COMPILED = {"C": "casimirs"} | {name: name for name in ("H", "g", "G", "H_p", "H_q", "B", "M")}
"""Names under which daebench itself computes what is printed, by the names in print."""


def expected(ivp, function, point):
    """Return a function as daebench's own generated code has it, or by differences of what is printed; U is H of a body at rest."""
    name, vectors = function.name, [point[argument] for argument in function.arguments]
    if name in COMPILED:
        return np.array(ivp.value(COMPILED[name], *vectors))
    if name == "U":
        return np.array(ivp.value("H", np.zeros(ivp.d), *vectors))
    base, order = name.split("_")
    first = {"g_qq": "G"}.get(name, f"{base}_{order[0]}" if len(order) == 2 else base)
    called, by = module(ivp)[first], order[-1]
    (arguments,) = (each.arguments for each in functions(ivp.source.derivation) if each.name == first)
    return differences(lambda x: np.array(called(ivp.par, *((point | {by: x})[each] for each in arguments)), dtype=float), point[by])


def module(ivp):
    names = {}
    exec(printed("python", ivp.problem, ivp.source.derivation), names)
    return names


def numbers(ivp, point):
    """Return what the functions printed as Python give at a point, each with its function."""
    names = module(ivp)
    for function in functions(ivp.source.derivation):
        yield function, np.asarray(names[function.name](ivp.par, *(point[name] for name in function.arguments)), dtype=float)


@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.parametrize("problem", PROBLEMS)
def test_python_gives_the_numbers_of_daebench_itself(problem):
    ivp = initial_value_problem(problem, consistent=False)
    assert module(ivp)["par"] == list(ivp.par)
    for point in points(ivp):
        for function, got in numbers(ivp, point):
            want = expected(ivp, function, point)
            near = 1e-13 if function.name in {*COMPILED, "U"} else 1e-6
            assert got.shape == want.shape, function.name
            assert np.allclose(got, want, rtol=near, atol=near * max(1.0, np.abs(want).max())), function.name


@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no C compiler")
@pytest.mark.parametrize("problem", PROBLEMS)
def test_c_compiles_without_a_warning_and_gives_the_same(problem, tmp_path):
    ivp = initial_value_problem(problem, consistent=False)
    (tmp_path / "printed.c").write_text(printed("c", problem, ivp.source.derivation).replace("static void", "void"))
    command = ["gcc", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-o", "printed.so", "printed.c", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    library, pointer = ctypes.CDLL(str(tmp_path / "printed.so")), ctypes.POINTER(ctypes.c_double)
    for point in points(ivp):
        for function, want in numbers(ivp, point):
            given = [np.array(vector, dtype=float) for vector in (ivp.par, *(point[argument] for argument in function.arguments))]
            out = np.full(max(1, len(function.flat)), np.nan)
            getattr(library, function.name)(*(vector.ctypes.data_as(pointer) for vector in (*given, out)))
            assert np.allclose(out, want.ravel(), rtol=1e-13, atol=1e-13), function.name


BY_ROWS = "by_rows(x) = x isa Number ? [float(x)] : float.(vec(permutedims(x, Tuple(ndims(x):-1:1))))\n"
PRINTS = {
    "julia": ("julia", "printed.jl", BY_ROWS, "println(join(by_rows({}), ' '))"),
    "javascript": ("node", "printed.mjs", "", "console.log([{}].flat().join(' '));"),
}
"""The program of a language, the name of a file, a definition, and the call that prints all entries of a value by rows."""


@pytest.mark.parametrize("language", PRINTS)
@pytest.mark.parametrize("problem", ["double_pendulum", "four_bar", "free_rigid_body"])
def test_another_language_gives_the_same(language, problem, tmp_path):
    program, file, head, call = PRINTS[language]
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    ivp = initial_value_problem(problem, consistent=False)
    point, derivation = next(points(ivp)), ivp.source.derivation
    values = [f"{each.name}({[*ivp.par]}, {', '.join(str(point[x].tolist()) for x in each.arguments)})" for each in functions(derivation)]
    (tmp_path / file).write_text(printed(language, problem, derivation) + head + "\n".join(map(call.format, values)))
    lines = subprocess.run([program, str(tmp_path / file)], check=True, capture_output=True, text=True).stdout.splitlines()
    for (function, want), line in zip(numbers(ivp, point), lines, strict=True):
        assert np.allclose([float(word) for word in line.split()], want.ravel(), rtol=1e-13, atol=1e-13), function.name


def test_blocks_of_julia_are_closed_and_indices_begin_at_one():
    for problem in GATE:
        derivation = initial_value_problem(problem, consistent=False).source.derivation
        code = printed("julia", problem, derivation)
        assert code.count("\nfunction ") == code.count("\nend\n") == len(functions(derivation))
        assert "[0]" not in code.replace("return [0]", "")
        assert "**" not in code


def test_json_is_read_back_as_the_same_expressions():
    derivation = initial_value_problem("double_pendulum", consistent=False).source.derivation
    text = json.loads(printed("json", "double_pendulum", derivation))
    assert list(text["par"]) == list(map(str, derivation.parameters))
    symbols = {str(symbol): symbol for symbol in (*derivation.parameters, *derivation.p, *derivation.q)}
    for function in functions(derivation):
        value = sp.Array(sp.sympify(text["functions"][function.name], locals=symbols))
        entries = sp.flatten(value.tolist()) if value.shape else [value[()]]
        assert all(sp.simplify(a - b) == 0 for a, b in zip(entries, function.flat, strict=True))


def test_the_command_prints_what_the_function_returns(daebench):
    derivation = initial_value_problem("planar_pendulum", consistent=False).source.derivation
    for language, more in [*((each, ()) for each in LANGUAGES), ("json", ("--json",))]:
        told = daebench("show", "planar_pendulum", "--as", language, *more)
        assert told == (0, printed(language, "planar_pendulum", derivation), "")


def test_what_cannot_be_printed_is_refused(daebench):
    for words, code in (
        (("planar_pendulum", "--as", "cobol"), "unknown-language"),
        (("planar_pendulum", "--as", "c", "--json"), "json-beside-code"),
        (("ablowitz_ladik", "--as", "c"), "lattice-not-printable"),
    ):
        assert daebench("show", *words)[0] == 2
        assert daebench.error.code == code
    with refused("too-many-nodes-to-print"):
        printed("c", "chain", initial_value_problem("pendulum_chain", parameters={"links": 2000}, consistent=False).source.derivation)
