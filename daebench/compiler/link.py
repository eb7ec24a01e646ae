"""The linker: finds what the functions of a scheme need of one problem, and writes the source of one module.

Files of schemes are read as syntax, to follow every call from the requested functions down: with the constants of the language settled, and
with functions that are passed by name. The derivation and the algebra are asked for exactly the names that are needed. What a module says
of files is a plan, by which :mod:`daebench.compiler.files` executes them.
"""

import ast
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from daebench.compiler import equal_terms
from daebench.compiler.cache import Wrapper, written
from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.files import Files, Function
from daebench.compiler.linear.algebras import Loops
from daebench.compiler.linear.elimination import Target
from daebench.compiler.number_types import NumberType, number_type
from daebench.compiler.plain import Plain
from daebench.compiler.reach import Reach
from daebench.compiler.shapes import OVERLOADS
from daebench.compiler.syntax import FORCES, LANGUAGE, TypedLiterals, in_single
from daebench.errors import InvalidProblem
from daebench.schemes.kernels.claims import MAPPED
from daebench.schemes.kernels.language import ROUNDINGS
from daebench.systems.files.package import text_of

_WORK = {name: name for name in ("H_p", "H_q", "g", "G")} | {"K_y": "H_q", "L_q": "H_q", "two_form": "second"}
_WORK |= dict.fromkeys(("H_pp", "H_qp", "H_pq", "H_qq", "Gv_p", "Gv_q", "A_qv", "curvature", "a_p", "L_qv"), "second")
_SOLVERS = "solve solve_d solve_dm solve_dd solve_2m solve_2s solve_2d solve_mass solve_mass_m solve_mass_d"
_SOLVERS += " solve_stages solve_stages_but_one solve_stages_twice solve_stages_twice_d"
_WORK |= dict.fromkeys(_SOLVERS.split(), "solve")
_UNCOUNTED = ("rows",)  # M^-1 on rows of G: counted as part of the algebra
_OF_NUMBERS = ("sqrt",)  # functions of numbers of any type, which each module imports
_PLAIN = ("worst", "total", "no_work", "plus_work", *_OF_NUMBERS)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a linked module."""

    precision: str = "float64"
    """Number type, see :func:`daebench.compiler.number_types.number_type`: "float64", "float32", "mixed", "complex128", "dual4" or
    "lanes8".
    """
    watch: tuple[str, ...] = ()
    """Quantities whose maximum error the loop takes: any of "energy", "manifold", "integrals"; or "samples" to store H and no states."""
    count: bool = False
    """Whether evaluations, solves and iterations are counted."""
    compiled: bool = True
    """Whether functions are machine code; otherwise Python executes what is recorded."""
    form: str = ""
    """Form of the system whose right side the scheme is given: "" for (1.18), "local", "canonical", "stiff", "soft", "baumgarte" or
    "darboux".
    """
    stages: int = 1
    """Number of stages of the scheme."""
    composed: bool = False
    compensated: bool = False
    """Whether a step consists of several substeps, and whether sums over steps are compensated for rounding."""
    projection: str = ""
    """Projection at the end of a step: "" for none, "proj" or "symproj"."""
    stage_multipliers: int = 0
    """Number of stage multipliers of a step that the loop stores."""
    singular: str = ""
    """Treatment of a loss of rank of G: "" if it is not monitored, "watch", or "least-squares" if systems of constraints are also solved
    that way.
    """
    asked: bool = False
    """Whether run-time data say when Newton's method is stopped: after how many iterations, or at which increments."""
    loops: bool = False
    """Whether vectors are arrays in place of tuples, and sums are loops, for a problem with many unknowns."""


def _constants(derivation: Derivation, options: Options, number: NumberType) -> dict[str, bool | int | float]:
    """Return the constants of the language."""
    once = number.lanes > 0 and not options.asked
    return (
        {"EXTENDED": False, "FORCED": False, "FREE": False, "ON_VELOCITIES": 0}
        | derivation.constants
        | {
            "MULTISTEP": False,
            "COMPOSED": options.composed,
            "COMPENSATED": options.compensated,
            "PROJECTED": options.projection == "proj",
            "LOCAL": options.form in MAPPED,
            "CANONICAL": options.form == "canonical",
            "STIFF": options.form == "stiff",
            "STAGES": options.stages,
            "RANK_WATCHED": bool(options.singular) and options.precision != "complex128",
            "SINGLE": derivation.constants.get("SINGLE", derivation.constants.get("CONSTRAINTS") == 1),
            "ONCE": once,
            "ONE_UNKNOWN": once and derivation.constants.get("CONSTRAINTS") == 1,
            "AGAIN": 1 if options.asked else number.again,
            "TANGENTS": number.directions > 0,
        }
        | ({} if options.asked else {"ITERATIONS_ASKED": 0, "ROUNDINGS": ROUNDINGS})
    )


RANK = "daebench.schemes.kernels.rank"
"""The file of whose functions a chain has its own."""

UNIQUE = ("loop", "constrained", "poisson", "composed", "mechanical", "rank", "canonical")
"""Files whose functions keep their names in generated modules."""


class Linker:
    """Collects the source of the requested functions and of everything that they need."""

    def __init__(self, derivation: Derivation, options: Options, scheme: str | None = None) -> None:
        self.derivation, self.options, self.scheme = derivation, options, scheme
        self.number = number_type(options.precision)
        least_squares, lanes = options.singular == "least-squares", self.number.lanes > 0
        target = Target(self.number.dtype, options.stages, least_squares, self.number.directions, lanes)
        self.algebra = Loops(derivation.algebra(target)) if options.loops else derivation.algebra(target)
        self.tables: dict[str, str] = dict(self.algebra.tables) if isinstance(self.algebra, Loops) else {}
        self.operations = set(self.algebra.names)
        self.called: list[str] = []
        self.solves = False
        self.kinds = derivation.work
        self.constants = _constants(derivation, options, self.number)
        kinds = len(self.kinds) if options.count else 0
        held = {"arrays": True} if options.loops else {}
        self.monitored = derivation.monitored(options.watch, kinds, options.stage_multipliers, **held)
        self.monitored.tangents = self.number.directions > 0
        known = {"constants": self.constants, "states": derivation.states, "single": False}
        self.files = Files(known, Plain({"EPS": 0.0, "INF": 0.0}))
        if scheme:
            self.constants["MULTISTEP"] = "start" in self.files.names_of(scheme)
        self.emitted: dict[str, str] = {}
        self.homes: dict[str, tuple[str, str]] = {}
        self.roots: dict[str, tuple[str, str]] = {}
        self.written: set[str] = set()
        self.iterated: set[str] = set()
        self.updates: dict[str, list[int]] = {}
        self.work: dict[str, list[int]] = {}
        self.sites: dict[str, int] = {}
        self.tracer = derivation.tracer(self)

    def module(self, title: str, roots: Sequence[tuple[str, str]], wrapper: Wrapper | None = None) -> str:
        """Return the source of a module with these functions, each given as (file, name), and all functions that they need.

        With a wrapper, they are only called by its functions.
        """
        emitted = [self.resolve(file, name) for file, name in roots]
        stand_ins, names = self.number.entries(emitted)
        called = set(re.findall(r"\b(\w+)\(", "\n".join(stand_ins)))
        self.roots |= {name: home for name, home in self.homes.items() if name in called}
        body, single = "\n\n".join([*self.emitted.values(), *stand_ins]), self.number.dtype == "float32"
        if single:
            body = ast.unparse(TypedLiterals().visit(ast.parse(body)))
        lines = [f"EPS = {self.number.eps}", *["BY_PYTHON = True"] * (not self.options.compiled)]
        lines.append("INF = " + ("numpy.float32(numpy.inf)" if single else "numpy.inf"))
        if self.tracer:
            lines += [f"DTYPE = numpy.{self.number.dtype}", f"REAL = numpy.{'float32' if single else 'float64'}", "ZERO = DTYPE(0)"]
        if self.number.lanes:
            lines.append(f"LANES = {self.number.lanes}")
        if self.scheme:
            lines += [f"EACH_{name.upper()} = {self._work_of_root(name)}" for name in ("one_step", "after_step", "initialise")]
        lines.append(f"ELEMENTWISE = {self.algebra.elementwise and not self.solves and 'def solve' not in body}")
        if self.options.loops:
            lines += ["ARRAYS = True", *(f"{name} = {source}" for name, source in self.tables.items())]
        texts = [body, *([wrapper.source(self.derivation)] if wrapper else []), *[self._files()] * bool(self.roots or self.called)]
        native = [name for name in names if name in self.roots]
        return written(title, wrapper.roots if wrapper else names, texts, lines, native)

    def _work_of_root(self, name: str) -> list[int]:
        return self.work.get(".".join(self.roots.get(name) or self.homes.get(name, ("", ""))), [])

    def _files(self) -> str:
        """Return the source that brings in the files of schemes."""
        plan = {
            "constants": self.constants,
            "homes": self.homes,
            "roots": self.roots,
            "operations": self.called,
            "written": {RANK: sorted(self.written)},
            "states": self.derivation.states,
            "bare": sorted({*_PLAIN, *self.number.functions, *self.operations}),
            "after": len(self.derivation.parameters),
            "work": self.updates if self.options.count else {},
            "sites": self.sites,
            "single": self.number.dtype == "float32",
            # Object files are stored under the digest of this source, which has no text of the files that are read with it.
            "texts": hashlib.sha256("".join(text_of(module) for module in sorted(self.files.read)).encode()).hexdigest(),
        }
        return f"from daebench.compiler.plain import files\n\nFILES = files(globals(), {plan}, {repr(self.algebra)!r})"

    def reached(self, function: Function, bound: Mapping[str, str]) -> str:
        """Read a function of a file with these functions for its callable parameters; return its key."""
        if self.tracer and function.module == RANK and self.tracer.written(function.name):
            self.written.add(function.name)
            return function.name
        key = " ".join([function.key, *bound.values()])
        if key not in self.work:
            # Entered before it is read, so that a function that leads back to itself is read once.
            self.work[key] = [0] * len(self.kinds)
            reach = Reach(self, function, bound)
            self.work[key] = reach.work
            for called, times in reach.calls.items():
                self.sites[called] = self.sites.get(called, 0) + times
        return key

    def resolve(self, module: str, name: str, bound: Mapping[str, str] = MappingProxyType({})) -> str:
        """Provide a name for generated text; return the name that it has there. ``bound`` are its callable parameters there."""
        if self.tracer and module in (LANGUAGE, RANK) and self.tracer.written(name):
            return name
        if module != LANGUAGE:
            self.reached(self.files.function(module, name), bound)
            file = module.rpartition(".")[2]
            emitted = name if file in UNIQUE else f"{file}_{name}"
            self.roots[emitted] = (module, name)
            return emitted
        self.needed(name)
        if name in self.homes:
            self.roots[name] = self.homes[name]
        elif name not in self.emitted:
            self.called.append(name)
        return name

    def needed(self, name: str) -> str:
        """Provide a name of the scheme language for files; return the key of its function."""
        if name in ("tally", "multiplier") or name in OVERLOADS or name in self.number.functions or name in _OF_NUMBERS:
            self.solves |= name.startswith("solve")
            return name
        if self.tracer and self.tracer.written(name):
            return name
        if name not in self.emitted and name not in self.homes:
            if home := self.filled(name):
                self.homes[name] = home
            else:
                for need in (*self.monitored.needs(name), *self.derivation.needs(name)):
                    self.resolve(LANGUAGE, need)
                source = self._of_problem(name) or (None if name in self.operations else self.monitored.source(name))
                if source is not None:
                    self.emitted[name] = source
                elif name not in self.operations:
                    self.homes[name] = self._composed(name)
        self.solves |= name.startswith("solve")
        return self.reached(self.files.function(*self.homes[name]), {}) if name in self.homes else name

    def _of_problem(self, name: str) -> str | None:
        """Return the source of the problem's function of this name, or None if it is not an expression of this problem."""
        if not self.options.loops:
            source: str | None = self.derivation.source(name)
            return in_single(source) if source and self.number.single_forces and name in FORCES else source
        written = equal_terms.source(self.derivation, name, self.number.dtype)
        if written is None:
            return None
        self.tables |= written[1]
        return written[0]

    def filled(self, name: str) -> tuple[str, str] | None:
        """Return file and function for a name that the scheme, its surroundings, or the form of the system must provide."""
        if name in ("one_step", "initialise", "after_step", "output", "state_norm"):
            return f"daebench.schemes.kernels.{self.derivation.states}", name
        if name == "f" or (name == "chart" and self.options.form == "canonical"):
            return f"daebench.schemes.kernels.{self.options.form or 'reduced'}", name
        if name == "step" and self.options.projection == "symproj":
            return "daebench.schemes.kernels.symmetric_projection", name
        if name in ("step", "plain_step"):
            has_step = "step" in self.files.names_of(str(self.scheme))
            return (str(self.scheme), "step") if has_step else ("daebench.schemes.kernels.constrained", "added")
        return (str(self.scheme), name) if name in ("start", "increment") else None

    def _composed(self, name: str) -> tuple[str, str]:
        for part in ("mechanical", "composed", "rank"):
            module = f"daebench.schemes.kernels.{part}"
            function = self.files.names_of(module).get(name)
            if isinstance(function, Function) and function.module == module and not (part == "mechanical" and self.derivation.explicit):
                return module, name
        raise InvalidProblem(f"a scheme asks for {name}, which is not defined for this problem.", "scheme-needs-undefined")

    def work_of(self, key: str, name: str) -> Sequence[int]:
        """Return the work that one call of this function counts for, without Newton iterations."""
        if name in self.derivation.costs:
            return self.derivation.costs[name]
        if name in _UNCOUNTED:
            return [0] * len(self.kinds)
        if counted := _WORK.get(name):
            return [int(kind == counted) for kind in self.kinds]
        return self.work.get(key, [0] * len(self.kinds))

    def iterates(self, update: str) -> None:
        """Take note of a function whose calls are counted by number of iterations."""
        work = self.work[update]
        self.iterated |= {kind for n, kind in zip(work, self.kinds, strict=True) if n}
        self.updates[update] = [n + (kind == "newton") for n, kind in zip(work, self.kinds, strict=True)]
