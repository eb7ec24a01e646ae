"""Generated code: it compiles without a warning, has the bits of machine code, tests itself, and says what its numbers mean."""

import dataclasses
import re
import shutil
import subprocess
import sys
from pathlib import Path

import contestants
import numpy as np
import pytest
from mechanisms import double_rod
from portable import require_portable
from refusals import refused

import daebench as package
from daebench.diagnostics.consistency import project
from daebench.methods.names import method_of
from daebench.pages.generation import linked, sentences
from daebench.pages.generation.languages import LANGUAGES
from daebench.runs.request import Request

COMPILERS = list(filter(None, map(shutil.which, ("gcc", "clang")))) or list(filter(None, [shutil.which("cc")]))
STRICT = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-ffp-contract=off", "-Wdouble-promotion", "-Wfloat-conversion")
PAIRS = [
    ("spherical_pendulum", "rattle", 0.01),
    ("spherical_pendulum", "shake", 0.01),
    ("double_pendulum", "lobatto3", 0.005),
    ("spherical_pendulum", "rattle/kahan_li8", 0.01),
    ("spherical_pendulum", "gauss3+proj", 0.01),
    ("spherical_pendulum", "local:gauss2", 0.01),
    ("rigid_water", "rattle_settle", 0.0005),
    ("four_bar_spring", "ggl_vi", 0.001),
    ("car_axis", "rattle", 1e-4),
    ("slider_crank_sundials", "rattle", 1e-3),
    ("andrews_squeezer", "rattle", 1e-5),
    ("cyclohexane_ring", "rattle", 1e-3),
    ("pendulum_chain", "rattle", 1e-3),
    ("fekete", "rattle", 1e-3),
    ("ablowitz_ladik", "strang", 1e-4),
    ("free_rigid_body", "strang", 0.01),
    ("lotka_volterra", "darboux:midpoint", 0.01),
    ("lotka_volterra", "symplectic_euler", 0.001),
    ("ablowitz_ladik", "darboux:verlet", 1e-4),
]
"""Pairs of each kind of code: tuples, solvers in loops, least squares, arrays, compositions, memories, charts, Poisson systems."""
SINGLE = [
    *(PAIRS[number] for number in (0, 1, 2, 4, 5, 13, 15, 16)),
    ("spherical_pendulum", "gauss2", 0.01),
    ("spherical_pendulum", "baumgarte:rk4", 0.01),
    ("slider_crank", "rattle/kahan_li8", 0.001),
    ("double_wishbone", "rattle", 0.001),
]
"""Pairs in single precision: schemes, memories, index-reduced forms, compositions, projections, charts, joints, loops, splittings."""


PRECISIONS = [*((*pair, "float64") for pair in PAIRS), *((*pair, "float32") for pair in SINGLE)]


PRECISIONS += [("spherical_pendulum", "rattle/kahan_li8", 0.001, "mixed")]


KINDS = {
    *("spherical_pendulum-shake-float64", "pendulum_chain-rattle-float64", "ablowitz_ladik-strang-float64"),
    *("lotka_volterra-darboux:midpoint-float64", "spherical_pendulum-baumgarte:rk4-float32", "spherical_pendulum-local:gauss2-float32"),
    *("free_rigid_body-strang-float32", "spherical_pendulum-rattle/kahan_li8-mixed"),
}
"""One of each kind; charts in double precision are in the other languages, least squares and compositions in tests of their own."""


needs_compiler = pytest.mark.skipif(not COMPILERS, reason="there is no compiler of C")


def ran(*command, **settings):
    """Return what a command prints that must succeed."""
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=True, **settings).stdout


def built(compiler, *words, standard="c99"):
    """Have a compiler build something without a warning."""
    told = subprocess.run([compiler, f"-std={standard}", *STRICT, *map(str, words)], capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr[:2000]


def compiled(folder, main, *flags, compiler=None):
    """Return the program of a main file with the code in a folder, whose object file is kept for the next program."""
    (code,) = (file for file in folder.glob("*.c") if file.stem not in ("example", "check", "main"))
    compiler = compiler or COMPILERS[0]
    kept, program = folder / f"{Path(compiler).name}.o", folder / main.removesuffix(".c")
    if not kept.exists():
        built(compiler, *flags, "-c", "-o", kept, code)
    built(compiler, *flags, "-o", program, folder / main, kept, "-lm")
    return program


def printed(folder, name, statements, *flags, compiler=None):
    """Return the numbers that C prints, after these statements about a state ``s``."""
    text = f"""#include <stdio.h>
#include "{name}.h"
#define SHOW(array, n) for (int i = 0; i < (int)(n); i++) printf("%a\\n", (double)(array)[i])
int main(void)
{{
    {name}_state s;
    {name}_default(&s);
    {statements}
    return 0;
}}
"""
    (folder / "main.c").write_text(text)
    return np.array([float.fromhex(line) for line in ran(compiled(folder, "main.c", *flags, compiler=compiler)).split()])


def state_after(ivp, method, h, steps, precision="float64"):
    """Return positions and momenta, or the unknowns, after so many steps."""
    request = Request(value=h, steps=steps, every=steps, watch=(), precision=precision)
    run = method_of(ivp, method).solve(ivp, request).complete()
    return run.y[-1] if hasattr(run, "y") else np.concatenate([run.q[-1], run.p[-1]])


def has_the_bits(problem, method, h, folder, precision="float64"):
    """Check that generated C has the bits of machine code after 300 steps, with each compiler that there is."""
    package.generate(problem, method, folder, h=h, name="own", precision=precision)
    ivp = package.initial_value_problem(problem)
    real, parts = "float" if precision == "float32" else "double", ("y",) if ivp.facts.KIND == "poisson" else ("q", "p")
    size = len(ivp.start[0])
    get = f"{real} {', '.join(f'{part}[{size}]' for part in parts)}; own_get(&s, {', '.join(parts)});"
    get += "".join(f"SHOW({part}, {size});" for part in parts)
    expected = state_after(ivp, method, h, 300, precision)
    for compiler in COMPILERS:
        found = printed(folder, "own", f"if (own_run(&s, OWN_STEP_SIZE, 300)) return 1;\n    {get}", compiler=compiler)
        assert np.array_equal(found, expected), compiler


@needs_compiler
@pytest.mark.sampled(by=KINDS.__contains__)
@pytest.mark.parametrize(
    ("problem", "method", "h", "precision"), PRECISIONS, ids=[f"{problem}-{method}-{of}" for problem, method, _, of in PRECISIONS]
)
def test_code_has_the_bits_of_machine_code_and_passes_its_own_check(problem, method, h, precision, tmp_path):
    folder = tmp_path / "code"
    has_the_bits(problem, method, h, folder, precision)
    passes_its_check(folder)
    source = (folder / "own.c").read_text() + (folder / "own.h").read_text()
    assert precision == "float64" or "float" in source
    if precision == "float32" and problem != "fekete":  # the run itself has tables of doubles there
        assert not re.findall(r"\bdouble\b|\b(?:sin|cos|sqrt|fabs|exp|log|pow)\(", source)


def passes_its_check(folder):
    """Check that all programs of a folder compile without a warning, and that its check finds five states good."""
    require_portable(folder)
    compiled(folder, "example.c")
    assert ran(compiled(folder, "check.c")).count("good") == 5


@needs_compiler
def test_a_library_in_single_precision_is_loaded_but_not_certified(tmp_path, daebench):
    folder = tmp_path / "code"
    asked = "spherical_pendulum --method rattle --h 0.01 --precision float32 --name own --out"
    assert daebench("generate", *asked.split(), folder)[0] == 0
    subprocess.run(["make", "-s", "libown.so"], cwd=folder, check=True)
    show = "import library as own; s = own.Integrator(); s.run(0.01, 100); print(s.q.dtype, s.init(s.q, 0 * s.q), s.energy < 0)"
    assert ran(sys.executable, "-c", show, cwd=folder) == "float32 0 True\n"
    assert daebench("certify", folder, "--out", tmp_path / "certificate")[0] == 2
    assert daebench.error.code == "generated-in-single-precision"
    assert "own_call" not in (folder / "own.h").read_text()


@needs_compiler
@pytest.mark.parametrize(("problem", "method"), [("double_pendulum", "rattle/kahan_li8")])
def test_a_kernel_that_is_divided_has_the_bits_too(problem, method, tmp_path, monkeypatch):
    monkeypatch.setitem(LANGUAGES, "c", dataclasses.replace(LANGUAGES["c"], longest=300))
    monkeypatch.setattr(linked, "PART", 300)
    has_the_bits(problem, method, 1e-3, tmp_path / "code")
    assert len(re.findall(r"^static void f\d", (tmp_path / "code" / "own.c").read_text(), re.M)) >= 2


READABLE = (("double_pendulum", "lobatto3"), ("car_axis", "rattle"), ("pendulum_chain", "rattle"))
CPP, NODE = shutil.which("g++") or shutil.which("c++"), shutil.which("node")
OTHERS = [PAIRS[2], PAIRS[5], PAIRS[8], PAIRS[12], PAIRS[14], PAIRS[16]]
"""Tuples, a chart, a system in time, a chain, a lattice, a Poisson system in canonical coordinates; the gate has each, in one language."""


LANGUAGE_TOOLS = {"python": sys.executable, "javascript": NODE, "cpp": CPP}
SHOWS = {
    "show.py": "import own\ns = own.Integrator()\ns.run({h!r}, 100)\n"
    "for name in {names}:\n    print(*getattr(s, name).tolist(), sep='\\n')\n",
    "show.mjs": 'import {{ Integrator }} from "./own.mjs";\nconst s = new Integrator(); s.run({h!r}, 100);\n'
    "for (const name of {names}) for (const x of s[name]) console.log(String(x));\n",
    "show.cpp": '#include "own.hpp"\n#include <cstdio>\nint main() {{ own::integrator s; s.run({h!r}, 100);\n{loops}\nreturn 0; }}\n',
}
"""Programs that print the numbers of a state after 100 steps, a line each."""
IN_THE_GATE = (
    "spherical_pendulum-local:gauss2-python",
    "car_axis-rattle-javascript",
    "lotka_volterra-darboux:midpoint-cpp",
)


def said_in(folder, language, names, h):
    """Return what the check of a folder says, and the numbers of the state."""
    loops = "\n".join(f'for (double x : s.{name}()) std::printf("%.17g\\n", x);' for name in names)
    for file, text in SHOWS.items():
        (folder / file).write_text(text.format(h=h, names=[*names], loops=loops))
    if language == "cpp":
        require_portable(folder)
        for main in ("example", "check", "show"):
            built(CPP, "-o", folder / main, folder / f"{main}.cpp", standard="c++17")
    ending = {"python": ".py", "javascript": ".mjs", "cpp": ""}[language]
    command = [] if language == "cpp" else [LANGUAGE_TOOLS[language]]
    check, shown = (ran(*command, folder / f"{main}{ending}", cwd=folder) for main in ("check", "show"))
    return check, np.array([float(line) for line in shown.split()])


def is_exact(folder, language):
    """Return whether code has the operations of machine code: Python that is made to be read has not, nor functions of JavaScript."""
    if language == "python":
        return "made to be read" not in (folder / "own.py").read_text()
    return language == "cpp" or not re.search(r"Math\.(?!sqrt|abs)", (folder / "own.mjs").read_text().partition("#scaled")[0])


@pytest.mark.sampled(by=lambda case: case in IN_THE_GATE)
@pytest.mark.parametrize("language", LANGUAGE_TOOLS)
@pytest.mark.parametrize(("problem", "method", "h"), OTHERS, ids=[f"{problem}-{method}" for problem, method, _ in OTHERS])
def test_other_languages_pass_their_own_check_and_have_the_bits_of_machine_code(problem, method, h, language, tmp_path):
    if LANGUAGE_TOOLS[language] is None:
        pytest.skip(f"there is nothing that runs {language}")
    folder = tmp_path / "code"
    package.generate(problem, method, folder, h=h, language=language, name="own")
    ivp = package.initial_value_problem(problem)
    check, found = said_in(folder, language, ("y",) if ivp.facts.KIND == "poisson" else ("q", "p"), h)
    assert check.count("good") == 5
    exact, expected = is_exact(folder, language), state_after(ivp, method, h, 100)
    assert language != "python" or exact == ((problem, method) not in READABLE)
    assert (
        np.array_equal(found, expected)
        if exact
        else np.allclose(found, expected, rtol=1e-11 if language == "javascript" else 1e-10, atol=1e-12)
    )


@pytest.mark.parametrize("problem", ["lotka_volterra", pytest.param("double_pendulum", marks=pytest.mark.exhaustive)])
def test_the_page_runs_from_a_file(problem, seen, tmp_path):
    method = "rattle" if problem == "double_pendulum" else "symplectic_euler"
    package.generate(problem, method, tmp_path / "code", h=0.002, language="javascript")
    shown = seen((tmp_path / "code" / "page.html").as_uri())
    shown.page.wait_for_function(
        "/to t = (0\\.[3-9]|[1-9]).*H0 = -?\\d\\.\\de[-+]\\d+\\.$/.test(document.querySelector('#told').innerText)"
    )
    shown.clean()


@needs_compiler
@pytest.mark.sampled(left_out=("chain", "loops"))
@pytest.mark.parametrize("pair", [PAIRS[0], PAIRS[12], PAIRS[13], PAIRS[16]], ids=["tuples", "chain", "loops", "Poisson"])
def test_nothing_undefined_happens(pair, tmp_path):
    problem, method, h = pair
    package.generate(problem, method, tmp_path / "code", h=h, name="own")
    program = compiled(tmp_path / "code", "check.c", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    told = subprocess.run([program], capture_output=True, text=True, check=False)
    assert (told.returncode, told.stderr) == (0, ""), told.stderr


@needs_compiler
def test_a_planted_fault_fails_the_check(tmp_path):
    package.generate("double_pendulum", "rattle", tmp_path / "code", h=0.005, name="own")
    file = tmp_path / "code" / "own.c"
    text = file.read_text()
    begin = text.index("static void step(")
    faults = [text.index("{", begin) + 1, *(begin + found.start() for found in re.finditer(r"P\[[0-4]\];", text[begin:]))]
    assert len(faults) == 6
    for place in faults[::2]:
        fault = "h *= 1.001;" if place == faults[0] else "1.001*"
        file.write_text(f"{text[:place]}{fault}{text[place:]}")
        (tmp_path / "code" / f"{Path(COMPILERS[0]).name}.o").unlink(missing_ok=True)
        program = compiled(tmp_path / "code", "check.c", "-O0")
        assert subprocess.run([program], capture_output=True, check=False).returncode == 1, text[place:][:80]


@needs_compiler
def test_a_start_is_made_consistent_and_multipliers_are_those_of_the_state(tmp_path):
    package.generate("double_pendulum", "rattle", tmp_path / "code", h=0.005, name="own")
    ivp = package.initial_value_problem("double_pendulum")
    q, v = ivp.q0 + 1e-3 * np.cos(np.arange(4)), np.sin(np.arange(4.0))
    numbers = [f"{{ {', '.join(map(repr, x.tolist()))} }}" for x in (q, v)]
    given = f"double q[4] = {numbers[0]}, v[4] = {numbers[1]}, p[4], g[2], gv[2], lam[2];"
    show = "own_get(&s, q, p); own_residuals(&s, g, gv); own_multipliers(&s, lam); own_velocities(&s, v);"
    show += "double H[1] = { own_energy(&s) }; SHOW(q, 4); SHOW(p, 4); SHOW(v, 4); SHOW(g, 2); SHOW(gv, 2); SHOW(lam, 2); SHOW(H, 1);"
    found = printed(tmp_path / "code", "own", f"{given}\n    if (own_init(&s, q, v)) return 1;\n    {show}")
    q1, p1, v1, g, gv, lam, H = np.split(found, np.cumsum([4, 4, 4, 2, 2, 2]))
    assert np.abs(np.concatenate([g, gv])).max() < 1e-14
    own = project(ivp, ivp.value("mass", v, q) @ v, q)
    assert np.allclose(np.concatenate([p1, q1]), np.concatenate(own[:2]), rtol=0, atol=1e-14)
    assert np.allclose(v1, ivp.value("H_p", p1, q1), rtol=1e-14)
    assert np.allclose(lam, ivp.value("lam", p1, q1), rtol=1e-11)
    assert H[0] == pytest.approx(float(ivp.value("H", p1, q1)), rel=1e-14)


@needs_compiler
def test_a_compiled_library_is_a_method_like_any_other(tmp_path):
    package.generate("double_pendulum", "rattle", tmp_path / "code", h=0.005, name="own")
    subprocess.run(["make", "-s", "libown.so"], cwd=tmp_path / "code", check=True)
    outside, own = (
        package.run("double_pendulum", method=method, h=0.005, steps=200) for method in (f"{tmp_path}/code/libown.so:own_call", "rattle")
    )
    assert np.array_equal((outside.q, outside.p), (own.q, own.p))
    show = "import library as own; s = own.Integrator(); s.run(0.005, 200); print(*s.q, *s.p, s.lam.size, s.message, sep='\\n')"
    out = ran(sys.executable, "-c", show, cwd=tmp_path / "code").splitlines()
    assert [*map(float, out[:8])] == [*own.q[-1], *own.p[-1]]
    assert out[8:] == ["2", "all is well"]


@needs_compiler
@pytest.mark.filterwarnings("ignore::daebench.diagnostics.derivative.DerivativeWarning")
def test_a_folder_is_certified_with_its_claims(tmp_path, daebench, monkeypatch):
    contestants.measure_briefly(monkeypatch)
    package.generate("planar_pendulum", "rattle", tmp_path / "code", h=0.01)
    status, out, err = daebench("certify", tmp_path / "code", "--out", tmp_path / "certificate")
    assert status == 0, err
    assert "5 of 5 claims" in out
    assert list((tmp_path / "certificate").rglob("planar_pendulum_rattle.c"))


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (None, "not-generated-code"),
        ("[]", "not-generated-code"),
        ('{"name": "../x", "precision": "float64", "on": "a", "h": 0.1, "claims": {}, "callable": true}', "not-generated-code"),
        ('{"name": "x", "precision": "float64", "on": "a", "h": 0.1, "claims": {}, "callable": false}', "generated-not-stepwise"),
        ('{"name": "x", "precision": "float64", "on": "a", "h": 0.1, "claims": {}, "callable": true}', "generated-not-compilable"),
    ],
    ids=["nothing", "no object", "path", "remembers", "no source"],
)
def test_a_folder_that_is_no_code_is_refused_in_a_sentence(content, code, tmp_path, daebench):
    if content is not None:
        (tmp_path / "generated.json").write_text(content)
    assert daebench("certify", tmp_path, "--out", tmp_path / "certificate")[0] == 2
    assert daebench.error.code == code


ODD = r'''"""Ends */ #error <b> \\"""
from daebench import Case, ConstrainedHamiltonian, coordinates
import sympy as sp

def problem(*, {arguments}) -> ConstrainedHamiltonian:
    """Return it.

    Parameters
    ----------
    double : float
        Length */ #error of the rod \\, m.
    """
    q, p = coordinates(2)
    names = sp.symbols("{names}", positive=True)
    mass = 1 + sum(names[3:])
    return ConstrainedHamiltonian(q=q, p=p, M=mass * sp.eye(2), U=mass * names[1] * q[1], g=[q[0] ** 2 + q[1] ** 2 - names[0] ** 2],
        parameters=dict(zip(names, [{values}])), cases={{"a": Case(q=(0, -names[0]), p=(names[2], 0))}})
'''
NAMES = ["double", "int", "new", *(f"weight{k}" for k in range(20))]


@needs_compiler
def test_many_parameters_keywords_among_them_and_texts_that_would_end_comments_are_taken(tmp_path):
    file = tmp_path / "odd.py"
    arguments = ", ".join(f"{name}: float = {k + 1}.0" for k, name in enumerate(NAMES))
    file.write_text(ODD.format(arguments=arguments, names=" ".join(NAMES), values=", ".join(NAMES)))
    for language in ("c", "python", "javascript"):
        package.generate(str(file), "rattle", tmp_path / language, h=0.001, language=language, name="own")
    assert "double double_; /* Length" in (tmp_path / "c" / "own.h").read_text()
    subprocess.run([compiled(tmp_path / "c", "check.c")], check=True, capture_output=True)
    subprocess.run([sys.executable, "check.py"], cwd=tmp_path / "python", check=True, capture_output=True)
    assert "<b>" not in (tmp_path / "javascript" / "page.html").read_text().partition("<script")[0]
    start = "s.parameters.double_ = 2.0; double q[2] = {0, -2}, v[2] = {1, 0}; if (own_init(&s, q, v)) return 1;"
    found = printed(tmp_path / "c", "own", f"{start} own_run(&s, 0.001, 100); double p[2]; own_get(&s, q, p); SHOW(q, 2);")
    assert np.hypot(*found) == pytest.approx(2.0, rel=1e-14)


IMPOSSIBLE = {
    "generate-without-fixed-step": {"method": "ida:index2"},
    "not-a-name-in-c": {"name": "while"},
    "unknown-language": {"language": "julia"},
    "unknown-name": {"precision": "float16"},
    "javascript-precision": {"language": "javascript", "precision": "float32"},
    "poisson-in-single-precision": {"problem": "lotka_volterra", "method": "strang", "precision": "mixed"},
    "generated-code-is-off": {"h": 0.9},
    "method-refuses-problem": {"method": "rattle_settle"},
    "too-many-nodes-to-generate": {"problem": "pendulum_chain", "parameters": {"links": 8}},
}


@pytest.mark.parametrize("code", IMPOSSIBLE)
def test_what_cannot_be_generated_is_refused_and_leaves_nothing(code, tmp_path):
    asked = {"problem": "spherical_pendulum", "method": "rattle", "h": 0.01, "out": tmp_path / "code"} | IMPOSSIBLE[code]
    with refused(code):
        package.generate(**asked)
    assert not (tmp_path / "code").exists()


def test_a_folder_that_is_there_stays_as_it_is(tmp_path):
    with refused("folder-already-there"):
        package.generate("spherical_pendulum", "rattle", tmp_path, h=0.01)
    assert list(tmp_path.iterdir()) == []
    code = package.generate("spherical_pendulum", "rattle", tmp_path, h=0.01, overwrite=True)
    assert sorted(code.files) == sorted(tmp_path.iterdir())


REDUNDANT = """
import sympy as sp
from daebench import Case, ConstrainedHamiltonian, coordinates

def problem() -> ConstrainedHamiltonian:
    q, p = coordinates(2)
    circle = q[0] ** 2 + q[1] ** 2 - 1
    swing = Case(q=(0, -1), p=(1, 0), on_singular="least-squares")
    return ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=q[1], g=[circle, 2 * circle], cases={"swing": swing})
"""


@needs_compiler
def test_redundant_constraints_are_solved_by_least_squares_with_the_bits_and_said_to_be(tmp_path):
    (tmp_path / "twice.py").write_text(REDUNDANT)
    has_the_bits(str(tmp_path / "twice.py"), "rattle", 0.01, tmp_path / "code")
    passes_its_check(tmp_path / "code")
    assert "least squares" in (tmp_path / "code" / "README.md").read_text()


def test_a_multiplier_of_a_distance_is_a_force_along_it():
    meant = sentences.multipliers(double_rod().problem())
    assert all("the force along the distance l is 2 lam l, tension where it is positive" in each for each in meant)
    assert "the distance of A and B in lower" in meant[1]
    (other,) = sentences.multipliers(package.initial_value_problem("torus").source.define())
    assert "the force is -lam grad g" in other
