"""The linker: joins a scheme's file with one problem's functions and algebra into the source of one module.

Scheme files and the files in ``kernels/`` are read as syntax and never run; operations of the algebra replace operators. From
the requested functions, the linker follows every call. In each function it settles the constants of the language, passes the
problem's parameters on, and specialises functions that are passed by name. It asks the derivation or the algebra for exactly the
remaining names.
"""

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

from daebench.compiler import codegen, places
from daebench.compiler.constrained import loops
from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.declared import Declarations
from daebench.compiler.linear.elimination_source import Target
from daebench.compiler.linear.loops import Loops
from daebench.compiler.number_types import number_type
from daebench.compiler.operators import Lowering
from daebench.compiler.single_forces import FORCES, in_single
from daebench.compiler.specialise import Specialise
from daebench.compiler.syntax import DATA, LANGUAGE, LANGUAGES, SourceFile, TypedLiterals
from daebench.compiler.wrapper import Wrapper
from daebench.compiler.written import written
from daebench.errors import InvalidProblem
from daebench.schemes.kernels.claims import MAPPED
from daebench.schemes.kernels.language import ROUNDINGS
from daebench.systems.files.package import text_of

_WORK = {name: name for name in ("H_p", "H_q", "g", "G")}
_WORK |= dict.fromkeys(("H_pp", "H_qp", "H_pq", "H_qq", "Gv_p", "Gv_q", "curvature", "a_p", "L_qv"), "second")
_WORK |= dict.fromkeys(("solve", "solve_d", "solve_dm", "solve_dd", "solve_2m"), "solve")
_WORK |= dict.fromkeys(("solve_mass", "solve_mass_m", "solve_mass_d"), "solve")
_WORK |= dict.fromkeys(("solve_stages", "solve_stages_but_one", "solve_stages_twice"), "solve")
_WORK |= dict.fromkeys(("solve_stages_twice_d", "solve_2d"), "solve") | {"K_y": "H_q", "L_q": "H_q", "two_form": "second"}
_UNCOUNTED = ("rows",)  # M^-1 on rows of G: counted as part of the algebra
_OF_NUMBERS = ("sqrt",)  # functions of numbers of any type, which each module imports
_PLAIN = ("worst", "total", "no_work", "plus_work", *_OF_NUMBERS)
HEADER = """\"\"\"{title}\"\"\"

import numpy
from numpy import *
from builtins import abs, max, min
"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a linked module.

    Parameters
    ----------
    precision : str
        Number type, see :func:`daebench.compiler.number_types.number_type`: "float64", "float32", "mixed", "complex128", "dual4" or
        "lanes8".
    watch : tuple of str
        Quantities whose maximum error the loop takes: any of "energy", "manifold", "integrals"; or "samples" to store H and no states.
    count : bool
        Whether evaluations, solves and iterations are counted.
    compiled : bool
        Whether functions are compiled; otherwise they run in Python.
    form : str
        Form of the system whose right side the scheme is given: "" for (1.18), "local", "canonical", "stiff", "soft", "baumgarte" or
        "darboux".
    stages : int
        Number of stages of the scheme.
    composed, compensated : bool
        Whether a step consists of several substeps, and whether sums over steps are compensated for rounding.
    projection : str
        Projection at the end of a step: "" for none, "proj" or "symproj".
    stage_multipliers : int
        Number of stage multipliers of a step that the loop stores.
    singular : str
        Treatment of a loss of rank of G: "" if it is not monitored, "watch", or "least-squares" if systems of constraints are also
        solved that way.
    asked : bool
        Whether run-time data say when Newton's method is stopped: after how many iterations, or at which increments.
    loops : bool
        Whether vectors are arrays in place of tuples, and sums are loops, for a problem with many unknowns.
    """

    precision: str = "float64"
    watch: tuple[str, ...] = ()
    count: bool = False
    compiled: bool = True
    form: str = ""
    stages: int = 1
    composed: bool = False
    compensated: bool = False
    projection: str = ""
    stage_multipliers: int = 0
    singular: str = ""
    asked: bool = False
    loops: bool = False


@lru_cache(256)
def _read(module: str, text: str, constants: tuple[tuple[str, bool | int | float], ...]) -> SourceFile:
    """Return a source file as syntax, which all linkers with these constants share, and its functions with operators replaced."""
    return SourceFile(module, text, dict(constants))


@cache
def _declared(module: str) -> SourceFile:
    """Return a file of the scheme language as syntax; its declarations are the same for every problem."""
    return SourceFile(module, text_of(module), {})


class Linker:
    """Collects the source of the requested functions and of everything that they need.

    Parameters
    ----------
    derivation : Derivation
        The problem.
    options : Options
        Number type, quantities to monitor, whether to count and to compile.
    scheme : str, optional
        Module name of the scheme that has the functions ``step`` and ``start``.
    """

    def __init__(self, derivation: Derivation, options: Options, scheme: str | None = None) -> None:
        self.derivation, self.options, self.scheme = derivation, options, scheme
        self.number = number_type(options.precision)
        least_squares, lanes = options.singular == "least-squares", self.number.lanes > 0
        target = Target(self.number.dtype, options.compiled, options.stages, least_squares, self.number.directions, lanes)
        self.algebra = Loops(derivation.algebra(target)) if options.loops else derivation.algebra(target)
        self.tables: dict[str, str] = dict(self.algebra.tables) if isinstance(self.algebra, Loops) else {}
        self.algebraic = cache(self.algebra.source)
        self.kinds = derivation.work
        self.constants: dict[str, bool | int | float] = (
            {"EXTENDED": False, "FORCED": False}
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
                "ONCE": self.number.lanes > 0 and not options.asked,
                "ONE_UNKNOWN": self.number.lanes > 0 and not options.asked and derivation.constants.get("CONSTRAINTS") == 1,
                "AGAIN": 1 if options.asked else self.number.again,
                "TANGENTS": self.number.directions > 0,
            }
            | ({} if options.asked else {"ITERATIONS_ASKED": 0, "ROUNDINGS": ROUNDINGS})
        )
        kinds = len(self.kinds) if options.count else 0
        held = {"arrays": True} if options.loops else {}
        self.monitored = derivation.monitored(options.watch, kinds, options.stage_multipliers, **held)
        self.monitored.tangents = self.number.directions > 0
        self.files: dict[str, SourceFile] = {}
        if scheme:
            self.constants["MULTISTEP"] = "start" in self.file(scheme).functions
        self.emitted: dict[str, str] = {}
        self.reading: set[str] = set()
        self.iterated: set[str] = set()
        self.work: dict[str, list[int]] = {}
        self.tracer = derivation.tracer(self)

    def module(self, title: str, roots: Sequence[tuple[str, str]], wrapper: Wrapper | None = None) -> str:
        """Return the source of a module with these functions, each given as (file, name), and all functions that they need.

        With a wrapper, they are only called by its functions.
        """
        emitted = [self.resolve(file, name) for file, name in roots]
        self.emitted |= {name: self._given_all(name) for name in emitted if self.scheme or name in self.reading}
        stand_ins, names = self.number.entries(emitted)
        body, single = "\n\n".join(self.emitted.values()), self.number.dtype == "float32"
        body = "\n\n".join([body, *stand_ins])
        if single:
            body = ast.unparse(TypedLiterals().visit(ast.parse(body)))
        lines = [HEADER.format(title=title), f"EPS = {self.number.eps}"]
        lines.append("INF = " + ("numpy.float32(numpy.inf)" if single else "numpy.inf"))
        if self.tracer:
            lines += [f"DTYPE = numpy.{self.number.dtype}", f"REAL = numpy.{'float32' if single else 'float64'}", "ZERO = DTYPE(0)"]
        if self.number.lanes:
            lines.append(f"LANES = {self.number.lanes}")
        if self.scheme:
            lines += [f"EACH_{name.upper()} = {self.work.get(name, [])}" for name in ("one_step", "after_step", "initialise")]
        elementwise = self.algebra.elementwise and "def solve" not in body and "def _solve" not in body
        lines.append(f"ELEMENTWISE = {elementwise}")
        if self.options.loops:
            lines += ["ARRAYS = True", *(f"{name} = {source}" for name, source in self.tables.items())]
        texts = [body, *([wrapper.source(self.derivation)] if wrapper else [])]
        if self.options.compiled:
            return written(title, wrapper.roots if wrapper else names, texts, lines[1:])
        return "\n".join([*lines, "\n", "\n\n".join(texts), ""])

    def _given_all(self, name: str) -> str:
        """Return the source of a function that is called from outside, for which the data of scheme and form are appended to ``par``."""
        (node,) = ast.parse(self.emitted[name]).body
        assert isinstance(node, ast.FunctionDef)
        node.args.args = [argument for argument in node.args.args if argument.arg != DATA]
        own = len(self.derivation.parameters) + 1
        parts = {DATA: f"par[{own}:]"} if name in self.reading else {}
        node.body[:0] = ast.parse("\n".join(f"{part} = {value}" for part, value in {**parts, "par": f"par[:{own}]"}.items())).body
        return ast.unparse(node)

    def given(self, emitted: str) -> list[str]:
        """Return the arguments appended to those of a function: the parameters, and the data of scheme and form if it reads them."""
        return ["par", DATA] if emitted in self.reading else ["par"]

    def file(self, module: str) -> SourceFile:
        """Return a source file as syntax."""
        if module not in self.files:
            self.files[module] = _read(module, text_of(module), tuple(sorted(self.constants.items())))
        return self.files[module]

    def lowered(self, module: str, name: str) -> ast.FunctionDef:
        """Return a function of a file with operators replaced by operations of the algebra, which the file then imports."""
        file = self.file(module)
        if name not in file.lowered:
            path = f"{module.replace('.', '/')}.py"
            lowering = Lowering(path, Declarations(file, lambda other: _declared(other) if other in LANGUAGES else self.file(other)))
            lowered = lowering.function(file.functions[name])
            for operation in sorted(lowering.used):
                if operation in file.functions or file.imports.get(operation, (LANGUAGE, operation)) != (LANGUAGE, operation):
                    raise InvalidProblem(f"{path}: {operation} is the name of an operation of the algebra; give the function another name.")
                file.imports[operation] = (LANGUAGE, operation)
            file.lowered[name] = lowered
        return file.lowered[name]

    def function(self, module: str, name: str, bound: Mapping[str, str]) -> str:
        """Emit a function of this name from this file, with these functions for its callable parameters; return its name."""
        emitted = places.emitted(module, name) + "".join(f"__{function}" for function in bound.values())
        if emitted not in self.emitted and emitted not in self.work:
            self.work[emitted] = [0] * len(self.kinds)
            function = self.lowered(module, name)
            specialise = Specialise(self, self.file(module), bound)
            linked = specialise.linked(function, emitted)
            if specialise.reads:
                self.reading.add(emitted)
            self.emitted[emitted] = ast.unparse(linked)
            self.work[emitted] = specialise.work
        return emitted

    def resolve(self, module: str, name: str) -> str:
        """Return the emitted name of an imported name of a file; emit its function first if it is new."""
        if self.tracer and (module == LANGUAGE or module == "daebench.schemes.kernels.rank") and self.tracer.written(name):
            return name
        if module != LANGUAGE:
            return self.function(module, name, {})
        if name in self.number.functions or name in _OF_NUMBERS:
            return name
        if filling := self.filled(name):
            return self.function(*filling, {})
        if name not in self.emitted:
            for needed in (*self.monitored.needs(name), *self.derivation.needs(name)):
                self.resolve(LANGUAGE, needed)
            source = self._of_problem(name) or self.algebraic(name) or self.monitored.source(name)
            if source is None:
                return self._composed(name)
            self.emitted[name] = source
        return name

    def _of_problem(self, name: str) -> str | None:
        """Return the source of the problem's function of this name, or None if it is not an expression of this problem."""
        if not self.options.loops:
            source: str | None = self.derivation.source(name)
            return in_single(source) if source and self.number.single_forces and name in FORCES else source
        written = loops.source(self.derivation, name, self.number.dtype)
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
            has_step = "step" in self.file(str(self.scheme)).functions
            return (str(self.scheme), "step") if has_step else ("daebench.schemes.kernels.constrained", "added")
        return (str(self.scheme), name) if name in ("start", "increment") else None

    def _composed(self, name: str) -> str:
        for part in ("mechanical", "composed", "rank"):
            file = self.file(f"daebench.schemes.kernels.{part}")
            if name in file.functions and not (part == "mechanical" and self.derivation.explicit):
                return self.function(file.name, name, {})
        raise InvalidProblem(f"a scheme asks for {name}, which is not defined for this problem.")

    def takes_par(self, module: str, name: str) -> bool:
        """Whether calls of this function pass on the problem's parameters."""
        return module != LANGUAGE or (self.algebraic(name) is None and name not in (*_PLAIN, *self.number.functions))

    def work_of(self, emitted: str, name: str) -> list[int]:
        """Return the work that one call of this function counts for, without Newton iterations."""
        if name in self.derivation.costs:
            return self.derivation.costs[name]
        if name in _UNCOUNTED:
            return [0] * len(self.kinds)
        if name in _WORK:
            return [int(kind == _WORK[name]) for kind in self.kinds]
        return self.work.get(emitted, [0] * len(self.kinds))

    def tally(self, update: str) -> str:
        """Emit the function that turns a number of iterations of ``update`` into work; return its name."""
        emitted = f"tally__{update}"
        self.iterated |= {kind for n, kind in zip(self.work[update], self.kinds, strict=True) if n}
        work = [n + (kind == "newton") for n, kind in zip(self.work[update], self.kinds, strict=True)]
        result = codegen.pack(f"{n} * iterations" for n in work) if self.options.count else "()"
        self.emitted[emitted] = codegen.function(f"{emitted}(iterations)", f"return {result}")
        return emitted
