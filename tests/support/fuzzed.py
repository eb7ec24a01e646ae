"""Command lines and problem files as nobody would write them, and the command line called on them in this process."""

import contextlib
import io
import signal
import sys

import typer
from hypothesis import strategies as st
from mistaken import KINDS, written

from daebench.cli.app import app, main
from daebench.errors import LONGEST

STATUSES = (0, 1, 2, 130)
PRINTED = "hello"
"""Printed by some of the problem files: it goes to standard error."""

SECONDS = 120
"""CPU seconds after which a call hangs."""


class Hangs(BaseException):
    """A call that takes longer than any of these may."""


def called(*words):
    """Return exit status, standard output and standard error of a command line."""

    def stop(*_):
        raise Hangs(words)

    out, err, old, argv = io.StringIO(), io.StringIO(), signal.signal(signal.SIGVTALRM, stop), sys.argv
    signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
    sys.argv = ["daebench", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as end:
        return end.code, out.getvalue(), err.getvalue()
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, old)
        sys.argv = argv
    raise AssertionError(f"{words} does not exit")


def require_well_ended(words, status, out, err):
    """Require one of the known statuses, no traceback, sentences of bounded length, and one sentence where the input is bad."""
    assert status in STATUSES, (words, err[-2000:])
    assert "Traceback" not in out + err, words
    assert all(len(line) <= LONGEST + 100 for line in err.splitlines()), words
    assert len(err.splitlines()) <= 20, words
    if status == 2:
        assert out == "", words
        assert err.rstrip().endswith((".", "?")), (words, err)
        said = [line for line in err.splitlines() if line != PRINTED]
        assert all(line.startswith("daebench: ") for line in said), (words, err)
    if status == 1:
        assert (out + err).strip(), words


JUNK = [
    "",
    " ",
    "0",
    "-1",
    "-0.0",
    "nan",
    "inf",
    "1e999",
    "1e-320",
    "9" * 60,
    "x",
    "é☃",
    "a\nb",
    "=",
    ",",
    ",,",
    "a=1",
    "mass=nan",
    "mass=0",
]
JUNK += [
    "mass=",
    "--",
    "-",
    ".",
    "..",
    "/",
    "~nobody/x.py",
    "\udcff",
    "\x00",
    "[red]",
    "%s",
    "{}",
    "x" * 3000,
    "1,2,3",
    "0x10",
    "1_0",
    "None",
    "1e400",
]

PROBLEMS = [
    "planar_pendulum",
    "planar_pendulum",
    "lotka_volterra",
    "pendulum_chain",
    "./ring.py",
    "./orbit.py",
    "planr_pendulum",
    "./nowhere.py",
]
METHODS = [
    "rattle",
    "se",
    "lobatto2",
    "rattle/suzuki4",
    "stiff:rk4",
    "rk4+proj",
    "local:rk4",
    "ida:index2",
    "ida:index2:magic",
    "scipy:RK45",
]
METHODS += [
    "strang",
    "midpoint",
    "lie",
    "lifted:rattle",
    "darboux:strang",
    "ratle",
    "rattle+",
    "rattle/",
    ":",
    "ida:",
    "a:b:c",
    "rattle,se",
    "rattle,,",
]
SIZES = ["0.1", "0.05", "1e308"]
ENDS = ["0.2", "0.1"]
POOLS = {
    "problem": PROBLEMS,
    "--problem": PROBLEMS,
    "--method": METHODS,
    "--methods": METHODS,
    "--h": SIZES,
    "--t-end": ENDS,
    "--steps": ["1", "2", "3", "1e3"],
    "--tol": ["1e-6", "1e-3", "1"],
    "--case": ["rotating", "horizontal", "turning", "even"],
    "--param": ["mass=2", "length=2", "links=2", "links=1e9", "rate=3", "length=-1"],
    "--option": ["alpha=1", "eps=1e-3", "rho_inf=0.5"],
    "--every": ["1", "0", "2"],
    "--points": ["3", "1"],
    "--q0": ["1,0", "0,-1", "1,1"],
    "--p0": ["0,0", "1,0"],
    "--y0": ["1,2", "-1,1"],
    "--watch": ["energy", "none", "manifold,energy", "casimirs", "integrals"],
    "--precision": ["float32", "mixed", "float64"],
    "--on-singular": ["stop", "continue", "least-squares"],
    "--algebra": ["values", "arrays"],
    "--out": ["out.csv", "out.npz", "out", "ring.py", "no/such/out.csv"],
    "--store": ["rows.db", "ring.py", "no/such/rows.db"],
    "--ensemble": ["1", "2", "1000000000"],
    "--stride": ["1", "1000000000"],
    "--halvings": ["1", "2"],
    "--workers": ["1", "2"],
    "--repeat": ["0", "1"],
    "--only": ["step-limit", "penalty", "step-limt"],
    "--ways": ["float32", "mixed", "sweeps=1", "newton=1e-3", "sweeps=0"],
    "--error": ["error_q", "defect", "eror"],
    "--scheduler": [],
    "name": ["planar_pendulum-rotating", "planar_pendulum-none", "why-symplectic?", "./nowhere.py", "./ring.py"],
    "--with": ["planar_pendulum-rotating", "planar_pendulum-none"],
    "file": ["ring.py", "rows.csv", "nowhere.csv"],
    "--times": ["0:1:0.5", "0,1", "1:0:1", "0:1:1e-300"],
    "--t": ["0", "0.5", "1e9"],
    "--format": ["csv", "json", "npz"],
    "what": ["problems", "methods", "lessons", "problmes"],
}

FORCED = {
    "long": ["--dry-run"],
    "precision": ["--dry-run"],
    "work-precision": ["--dry-run"],
    "stability": ["--dry-run"],
    "bench": ["--methods", "ida:index2"],
    "animate": ["--seconds", "0.1", "--t-end", "0.1"],
}
"""Words that come last, so that a call is short whatever comes before."""

LEFT_OUT = {"lesson", "reproduce", "archive", "reference build", "reference verify"}
"""Commands that serve, or take minutes, whatever they are given; the tests of each refuse what they must."""


def commands(group=None, before=()):
    """Return all commands, by the words that call them."""
    group = typer.main.get_command(app) if group is None else group
    found = {}
    for name, each in group.commands.items():
        found |= commands(each, (*before, name)) if hasattr(each, "commands") else {" ".join((*before, name)): each}
    return {name: each for name, each in found.items() if name not in LEFT_OUT}


ONE = {"problem": "planar_pendulum", "--method": "rattle", "--h": "0.1"}
SEVERAL = {"problem": "planar_pendulum", "--methods": "rattle,se", "--h": "0.1"}
BASES = {
    "list": [{}],
    "show": [{"problem": "./ring.py"}, {"problem": "./orbit.py"}],
    "run": [
        ONE | {"--steps": "2"},
        {"problem": "./orbit.py", "--method": "lie", "--h": "0.1", "--steps": "2"},
        {"problem": "./ring.py", "--method": "ida:index2", "--tol": "1e-6", "--t-end": "0.1"},
        ONE | {"problem": "pendulum_chain", "--steps": "1"},
    ],
    "compare": [
        SEVERAL | {"--t-end": "0.2"},
        {"problem": "./orbit.py", "--methods": "lie,midpoint", "--anyway": None, "--h": "0.1", "--t-end": "0.2"},
    ],
    "order": [{"problem": "./ring.py", "--methods": "rattle", "--halvings": "1", "--t-end": "0.2"}],
    "check": [{"problem": "./ring.py"}, {"problem": "./ring.py", "--method": "symplectic_euler", "--steps": "2", "--h": "0.01"}],
    "precision": [{"problem": "planar_pendulum", "--methods": "rattle", "--h": "0.1", "--t-end": "0.2", "--repeat": "0"}],
    "work-precision": [{"problem": "planar_pendulum", "--methods": "rattle", "--h": "0.1", "--t-end": "0.2", "--repeat": "0"}],
    "stability": [{"problem": "planar_pendulum", "--methods": "rattle", "--h": "0.1", "--t-end": "0.2"}],
    "long": [SEVERAL | {"--methods": "rattle", "--steps": "1e3"}],
    "animate": [SEVERAL | {"--methods": "se", "--out": "out.svg"}],
    "bench": [{"--problem": "planar_pendulum", "--h": "0.1"}],
    "export": [{"file": "rows.db", "--out": "out.csv"}],
    "report": [{"name": "./ring.py"}],
    "reference at": [{"problem": "planar_pendulum", "--case": "rotating", "--t": "0.5"}],
    "reference compare": [{"file": "rows.csv", "--with": "planar_pendulum-rotating"}],
    "reference export": [{"name": "planar_pendulum-rotating", "--times": "0,1", "--out": "out.csv"}],
    "reference show": [{"name": "planar_pendulum-rotating"}],
}
"""Calls that are right, of which others are made by changing a few words."""


def command_lines(name):
    """Return a strategy for the words after ``daebench`` that call a command: a right call with some of its words changed."""
    labels = {each.opts[0]: getattr(each, "is_flag", False) for each in commands()[name].params if each.name != "help"}
    few = {label: st.just(None) if flag else _value(name, label) for label, flag in labels.items()}
    changes = st.lists(st.sampled_from(sorted(few)), max_size=3, unique=True).flatmap(
        lambda some: st.fixed_dictionaries({x: few[x] for x in some})
    )
    removed = st.one_of(st.just(set()), st.just(set()), st.sampled_from(sorted(few)).map(lambda label: {label}))
    stray = st.sampled_from([[], [], [], [], [], [], ["--nonsense"], ["-x"], ["stray"], ["é" * 500]])
    parts = st.tuples(st.sampled_from(BASES.get(name, [{}])), changes, removed, stray)
    return parts.map(lambda four: [*name.split(), *_words(four[0] | four[1], four[2], labels), *four[3], *FORCED.get(name, [])])


def _value(name, label):
    if name == "report" and label == "name":
        return st.sampled_from([*JUNK, "index-reductoin", "./nowhere.py", "./ring.py"])
    known = st.sampled_from(POOLS.get(label) or JUNK)
    return st.one_of(known, known, st.sampled_from(JUNK))


def _words(given, removed, labels):
    left = {label: value for label, value in given.items() if label not in removed and label in labels}
    options = [label if value is None else f"{label}={value}" for label, value in left.items() if label.startswith("-")]
    return [*(value for label, value in left.items() if not label.startswith("-")), *options]


ATOMS = {"bead": ["q[0]", "q[1]", "p[0]", "m"], "species": ["u", "v", "a"], "links": ["x[0]", "x[1]", "m", "k"]}
NUMBERS = [
    "0",
    "1",
    "-1",
    "2.5",
    "1e308",
    "10**400",
    "1e-320",
    "float('nan')",
    "sp.oo",
    "sp.I",
    "sp.zoo",
    "sp.Rational(1, 3)",
    "sp.pi",
    "True",
    "'1'",
    "1j",
]
FUNCTIONS = [
    "sp.sin",
    "sp.exp",
    "sp.log",
    "sp.sqrt",
    "sp.Abs",
    "sp.sign",
    "sp.gamma",
    "sp.loggamma",
    "sp.besselj",
    "sp.floor",
    "sp.atan",
    "1/",
]
FUNCTIONS += [
    "sp.Function('V')",
    "sp.Heaviside",
    "sp.DiracDelta",
    "sp.erf",
    "sp.LambertW",
    "sp.conjugate",
    "sp.Matrix",
    "sp.Eq",
    "sp.nonsense",
    "-",
]
WRONG = [
    "None",
    "3",
    "'text'",
    "[]",
    "{}",
    "()",
    "[1, 2]",
    "sp.Matrix([[1, 2], [3, 4]])",
    "sp.eye(2)",
    "sp.zeros(2, 2)",
    "lambda: 1",
    "object()",
    "m",
]
WRONG += [
    "sp.Symbol('stray')",
    "sp.MatrixSymbol('A', 2, 2)",
    "float('inf')",
    "range(3)",
    "{'a': 1}",
    "sp.Interval(0, 1)",
    "sp.Lt(m, 1)",
    "b'x'",
    "...",
]
LINES = [
    "pass",
    "1 / 0",
    "raise SystemExit(3)",
    "raise ValueError('x' * 10**5)",
    "raise BaseException('odd')",
    "raise GeneratorExit",
    "q = 3",
]
LINES += [
    "import nowhere",
    f"print({PRINTED!r})",
    "return 3",
    "return None",
    "del sp",
    "import sys; sys.exit()",
    "raise KeyError(object())",
    "m = 1",
    "f = lambda: f(); f()",
]
LINES += [
    "import warnings; warnings.warn('careful')",
    "raise UnicodeDecodeError('utf-8', b'x', 0, 1, 'bad')",
    "raise MemoryError",
    "raise OSError(28, 'full')",
]


def expressions(kind):
    """Return a strategy for texts of expressions."""
    leaves = st.sampled_from([*ATOMS[kind], *ATOMS[kind], *NUMBERS])

    def wider(inner):
        both = st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "**"]), inner)
        return st.one_of(
            both.map(lambda three: f"({three[0]} {three[1]} {three[2]})"),
            st.tuples(st.sampled_from(FUNCTIONS), inner).map(lambda two: f"{two[0]}({two[1]})"),
        )

    return st.recursive(leaves, wider, max_leaves=4)


def problem_files():
    """Return a strategy for kinds of problem files with mistakes, and their texts."""
    return st.sampled_from(list(KINDS)).flatmap(lambda kind: st.tuples(st.just(kind), _texts(kind)))


def _texts(kind):
    parts = [name for name in KINDS[kind][1] if name not in ("parameter", "lines", "more")]
    wrapped = st.tuples(
        expressions(kind),
        st.sampled_from(["{}", "[{}]", "({0}, {0})", "sp.Matrix([[{0}, 1], [1, {0}]])", "sp.diag({0}, {0})", "{{m: {}}}"]),
    )
    value = st.one_of(st.sampled_from(WRONG), wrapped.map(lambda two: two[1].format(two[0])))
    wrong = st.dictionaries(st.sampled_from(parts), value, max_size=2)
    right = expressions(kind).map(lambda text: _shaped(kind, text))
    replaced = st.one_of(wrong, right, right, st.tuples(wrong, right).map(lambda two: two[0] | two[1]))
    lines = st.one_of(st.just("pass"), st.just("pass"), st.sampled_from(LINES))
    plain = st.tuples(replaced, lines).map(lambda two: written(kind, lines=two[1], **_fitting(two[0])))
    spoilt = st.tuples(
        plain,
        st.integers(0, 900),
        st.integers(0, 40),
        st.sampled_from(["", "\x00", "\udcff", "é", "(", "\\", '"""', "\t", "lambda", "9" * 5000]),
    )
    return st.one_of(plain, plain, plain, spoilt.map(lambda four: four[0][: four[1]] + four[3] + four[0][four[1] + four[2] :]))


def _shaped(kind, text):
    """Return a part of the right shape that has an expression in it."""
    if kind == "bead":
        kinetic = f"M=sp.diag(2 + {text}, m), U=q[1]" if "q" in text and len(text) % 3 == 0 else f"H=(p[0] ** 2 + p[1] ** 2) / 2 + {text}"
        return {"H": kinetic} if len(text) % 2 else {"g": f"[q[0] ** 2 + q[1] ** 2 - 1 + {text} - {text}]"}
    return {"H": f"u - sp.log(u) + v + {text}"} if kind == "species" else {"U": f"m * x[1] + {text}"}


def _fitting(parts):
    """Return parts whose H has its name, as the constrained problem writes it."""
    return {name: f"H={text}" if name == "H" and "=" not in text and "u -" not in text else text for name, text in parts.items()}
