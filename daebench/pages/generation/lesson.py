"""A scheme on a constrained problem as Python to be read: the problem's functions as formulas, and the scheme's own file in NumPy.

The text of a scheme is that of its file, with branches on properties of the problem decided, and without what only daebench needs:
annotations, counts of work, and the walk that finds out whether a step landed on another branch of g = 0.
"""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import chain
from pprint import pformat
from typing import Any

import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from daebench.compiler.facts import in_loops
from daebench.compiler.syntax import LANGUAGES, RUN_TIME
from daebench.pages.generation import algebra
from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem
from daebench.schemes.kernels import language
from daebench.schemes.kernels.claims import MAPPED
from daebench.systems.files.package import text_of

BLOCKS = ("solve_stages", "solve_stages_but_one", "solve_2s")
"""Operations that are one function in NumPy."""

WORK = ("tally", "no_work", "plus_work")
"""Counts of work, at the ends of reports."""

CHECKED = {"on_branch": 6, "settled_on": 5}
"""Functions that add to a report whether a step landed on another branch, with the place of the report among their arguments."""

SCALES = {"LENGTH": "par.scale_length", "RATE": "par.scale_rate"}
"""Run-time data that stand among the parameters."""

OUTER = ("energy_momentum", "livens")
"""Files in which a vector stands as a row, which NumPy does not tell from a column."""

WIDTH = 118
"""Letters of the longest line of a formula."""

DEFINED = ("H", "U", "g")
"""Functions that are as in the definition."""

FEW = 40
"""Operations of a function whose common terms have no names."""

code = NumPyPrinter({"fully_qualified_modules": True}).doprint


class Unreadable(Exception):
    """Something that has no form to be read."""


@dataclass
class Lesson:
    """The texts of a readable file, as they are found from the roots on."""

    derivation: Any
    """The problem."""
    homes: Mapping[str, tuple[str, str]]
    """Files and names of functions that take the places of names of the language."""
    constants: Mapping[str, Any]
    """Constants of the language."""
    names: Mapping[sp.Symbol, str]
    """Texts of the parameters."""
    constraints: Sequence[str]
    """What each constraint keeps, in words."""
    of_problem: dict[str, str] = field(default_factory=dict)
    of_scheme: dict[str, dict[str, str]] = field(default_factory=dict)
    of_algebra: dict[str, str] = field(default_factory=dict)
    known: dict[str, str] = field(default_factory=dict)
    data: set[str] = field(default_factory=set)
    taken: dict[str, tuple[str, str]] = field(default_factory=dict)

    def language(self, name: str) -> str:
        """Provide a name of the scheme language; return its name in the file."""
        if name in SCALES:
            return SCALES[name]
        if name in RUN_TIME or name == "I":
            self.data.add(name)
        elif name in self.constants:
            self.known[name] = f"{name} = {self.constants[name]!r}"
        elif name in self.homes:
            return self.of_file(*self.homes[name], name)
        elif name in BLOCKS or hasattr(algebra, name):
            return self.algebraic("solve_blocks" if name in BLOCKS else name)
        elif name not in self.of_problem:
            self.of_problem[name] = ""  # for its place
            self.of_problem[name] = self.formula(name)
        return name

    def algebraic(self, name: str) -> str:
        """Provide an operation of the algebra, with those that it calls."""
        function = getattr(algebra, name, None)
        if function is None:
            raise Unreadable(name)
        if inspect.isfunction(function) and name not in self.of_algebra:
            text = inspect.getsource(function)
            node = ast.parse(text).body[0]
            self.of_algebra[name] = _edited(text, node, [_signature(text, node)])
            for called in re.findall(r"\b[a-z]\w*(?=\()", text):
                if called != name and hasattr(algebra, called):
                    self.algebraic(called)
        return name

    def formula(self, name: str) -> str:
        """Return a function of the problem."""
        rule = self.derivation.rule(name)
        if rule is None:
            raise Unreadable(name)
        arguments, values, shape = rule
        entries = [sp.sympify(x) for x in values]
        about = inspect.getdoc(getattr(language, name))
        lines = [f"def {name}({', '.join(arguments)}):", f'    """{about}"""']
        if name == "mass" and "M" in self.of_problem:
            return "\n".join([*lines, "    return M(q)"])
        plain = dict(self.names)
        for vector, symbols in arguments.items():
            plain |= {symbol: f"{vector}[{k}]" for k, symbol in enumerate(symbols)}
        used = set().union(*(x.free_symbols for x in entries))
        as_symbols = {symbol: sp.Symbol(text, real=True) for symbol, text in plain.items() if symbol in used}
        entries = [x.xreplace(as_symbols) for x in entries]
        if name not in DEFINED and sum(x.count_ops() for x in entries) > FEW:
            shared, entries = sp.cse(entries, symbols=sp.numbered_symbols("t"), order="none")
            for symbol, x in shared:
                lines += _statement(f"{symbol} = ", _text(x))
        comments = self.constraints if name == "g" else ()
        return "\n".join([*lines, *_result([_text(x) for x in entries], shape, comments)])

    def of_file(self, module: str, name: str, shown: str = "") -> str:
        """Provide a function or a constant of a file; return its name here."""
        if module.endswith(".newton"):
            return self.algebraic(name)
        shown = shown or name
        if self.taken.setdefault(shown, (module, name)) != (module, name):
            shown = f"{module.rpartition('.')[2]}_{name}"
            self.taken[shown] = module, name
        texts = self.of_scheme.setdefault(module, {})
        if shown not in texts:
            texts[shown] = ""
            texts[shown] = self._defined(module, name, shown)
        return shown

    def _defined(self, module: str, name: str, shown: str) -> str:
        node = self.names_of(module).get(name)
        if isinstance(node, ast.FunctionDef):
            return _Body(self, module, node).written(shown)
        if isinstance(node, ast.Assign):
            return f"{shown} = {ast.unparse(node.value)}"
        raise Unreadable(name)

    def name(self, module: str, name: str) -> str:
        """Provide the meaning of a name in a file; return its name here."""
        meaning = self.names_of(module).get(name)
        if not isinstance(meaning, tuple):
            return self.of_file(module, name) if meaning else name  # of Python
        if meaning[0] in LANGUAGES or meaning[0].endswith(".spaces"):
            return self.language(meaning[1])
        return self.of_file(*meaning)

    def names_of(self, module: str) -> dict[str, Any]:
        """Return the names of a file: statements, or file and name of what is imported."""
        return _names_of(module, tuple(self.constants.items()))


class _Body:
    """One function of a file, as it stands in the text."""

    def __init__(self, lesson: Lesson, module: str, node: ast.FunctionDef) -> None:
        self.lesson, self.module, self.node = lesson, module, node
        self.text = text_of(module)
        self.edits: set[tuple[int, int, str]] = set()

    def written(self, shown: str) -> str:
        """Return its text, without statements whose results nothing reads."""
        local = {x.arg for x in ast.walk(self.node) if isinstance(x, ast.arg)} | _bound(self.node)
        read: dict[tuple[int, int], str] = {}
        for statement in reversed(self.node.body[1:]):
            if isinstance(statement, ast.Assign) and not _bound(statement) & set(read.values()):
                begin, end = _span(self.text, statement)
                self.edits.add((self.text.rindex("\n", 0, begin), end, ""))
            else:
                standing = [x for x in self._standing(statement) if isinstance(x, ast.Name) and isinstance(x.ctx, ast.Load)]
                read |= {_span(self.text, x): x.id for x in standing}
        for place, name in sorted(read.items()):
            if name not in local and (renamed := self.lesson.name(self.module, name)) != name:
                self.edits.add((*place, renamed))
        return _edited(self.text, self.node, [_signature(self.text, self.node, shown), *self.edits])

    def _standing(self, node: ast.AST) -> Iterator[ast.AST]:
        """Yield a node and those in it that stay in the text; note the places of others."""
        begin, end = _span(self.text, node) if hasattr(node, "lineno") else (0, 0)
        if (others := self._in_place_of(node)) is not None:
            places = [_span(self.text, x) for x in others] or [(end, end)]
            self.edits |= {(begin, places[0][0], "" if others else "pass"), (places[-1][1], end, "")}
        elif (count := _count(node)) is not None:
            self.edits.add((_span(self.text, node.elts[-2])[1], _span(self.text, count)[1], ""))  # type: ignore[attr-defined]
            others = node.elts[:-1]  # type: ignore[attr-defined]
        else:
            yield node
            others = list(ast.iter_child_nodes(node))
        for other in others:
            yield from self._standing(other)

    def _in_place_of(self, node: ast.AST) -> Sequence[ast.AST] | None:
        """Return one side of a branch on constants, or the report in a check of the branch of g = 0; None for another node."""
        constants = self.lesson.constants
        if isinstance(node, ast.If) and {x.id for x in ast.walk(node.test) if isinstance(x, ast.Name)} <= constants.keys():
            return node.body if eval(ast.unparse(node.test), {}, dict(constants)) else node.orelse
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CHECKED:
            return [node.args[CHECKED[node.func.id]]]
        return None


def _bound(node: ast.AST) -> set[str]:
    """Return the names that a statement binds."""
    return {x.id for x in ast.walk(node) if isinstance(x, ast.Name) and isinstance(x.ctx, ast.Store)}


def _count(node: ast.AST) -> ast.AST | None:
    """Return the count of work at the end of a report; None if there is none."""
    last = node.elts[-1] if isinstance(node, ast.Tuple) and node.elts else None
    return last if isinstance(last, ast.Call) and isinstance(last.func, ast.Name) and last.func.id in WORK else None


@cache
def _names_of(module: str, constants: tuple[tuple[str, Any], ...]) -> dict[str, Any]:
    """Return the names of a file: statements, or file and name of what is imported, with branches on constants decided."""
    names: dict[str, Any] = {}

    def add(body: Sequence[ast.stmt]) -> None:
        for node in body:
            if isinstance(node, ast.If):
                add(node.body if eval(ast.unparse(node.test), {}, dict(constants)) else node.orelse)
            elif isinstance(node, ast.ImportFrom):
                names.update({alias.asname or alias.name: (str(node.module), alias.name) for alias in node.names})
            else:
                names.update(dict.fromkeys([node.name] if isinstance(node, ast.FunctionDef) else _bound(node), node))

    add(ast.parse(text_of(module)).body)
    return names


def _span(text: str, node: Any) -> tuple[int, int]:
    """Return the places where a node begins and ends; texts are in ASCII."""
    lines = _lines(text)
    return lines[node.lineno - 1] + node.col_offset, lines[node.end_lineno - 1] + node.end_col_offset


@cache
def _lines(text: str) -> list[int]:
    """Return where lines begin."""
    return [0, *(end.end() for end in re.finditer("\n", text))]


def _signature(text: str, node: Any, name: str = "") -> tuple[int, int, str]:
    """Return the edit that leaves annotations out of the head of a function."""
    given = [x.arg for x in node.args.args]
    for k, default in enumerate(reversed(node.args.defaults), 1):
        given[-k] += f"={ast.unparse(default)}"
    begin, _ = _span(text, node)
    # A comment for the type checker is a part of the head, and has a colon of its own.
    head = re.sub(r"( *# type:[^\n]*)\n\s*$", lambda match: " " * len(match[1]), text[begin : _span(text, node.body[0])[0]])
    end = begin + head.rindex(":") + 1
    end = text.index("\n", end) if text[end:].lstrip(" ").startswith("# type:") else end
    return begin, end, f"def {name or node.name}({', '.join(given)}):"


def _edited(text: str, node: ast.AST, edits: Sequence[tuple[int, int, str]]) -> str:
    """Return the text of a node with parts of it replaced."""
    begin, end = _span(text, node)
    begin = text.rfind("\n", 0, begin) + 1
    for first, last, new in sorted(edits, reverse=True):
        text = text[:first] + new + text[last:]
        end += len(new) - (last - first)
    return textwrap.dedent(text[begin:end])


def _text(x: Any) -> str:
    return re.sub(r"\bnumpy\.", "np.", re.sub(r"([\w.]+(?:\[\d+\])?)\*\*\(-1\.0\)", r"1/\1", code(x)))


def _statement(head: str, x: str) -> list[str]:
    """Return a statement that ends with an expression, in parentheses over several lines if it is long."""
    return _wrapped(f"    {head}{x}") if len(x) < WIDTH else [f"    {head}(", *_wrapped(f"        {x}"), "    )"]


def _wrapped(line: str) -> list[str]:
    """Return lines for one that is long, broken at its spaces."""
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return textwrap.wrap(line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def _result(entries: Sequence[str], shape: tuple[int, ...], comments: Sequence[str] = ()) -> list[str]:
    """Return the statement that returns entries, with a line for each row of a matrix, and for each entry of a long vector."""
    if not shape:
        return _statement("return ", entries[0])
    if len(shape) == 1:
        line = f"    return np.array([{', '.join(entries)}], REAL)"
        if len(line) < WIDTH and not any(comments):
            return [line]
        above = [[f"        # {comment}"] if comment else [] for comment in comments] or [[]] * len(entries)
        rows = [[*comment, *_wrapped(f"        {entry},")] for comment, entry in zip(above, entries, strict=True)]
        return ["    return np.array([", *chain.from_iterable(rows), "    ], REAL)"]
    if not entries:
        return [f"    return np.zeros({shape}, REAL)"]
    rows = [_wrapped(f"        [{', '.join(entries[k : k + shape[1]])}],") for k in range(0, len(entries), shape[1])]
    return ["    return np.array([", *chain.from_iterable(rows), "    ], REAL)"]


def lesson(ivp: InitialValueProblem, method: Any, names: Sequence[str]) -> dict[str, Any]:
    """Return the names in a readable file: texts of a method on a problem, whose parameters have these names; {} if they have none."""
    if not isinstance(ivp, ConstrainedIvp) or not _plain(ivp, method):
        return {}
    linker = method.read(ivp)
    texts = dict(zip(linker.derivation.parameters, (f"par.{name}" for name in names), strict=False))
    reader, multistep = (
        Lesson(linker.derivation, linker.homes, linker.constants, texts, ivp.facts.CONSTRAINED_BY),
        bool(linker.constants["MULTISTEP"]),
    )
    around = ["start"] * multistep + ["after_step"] * bool(method.projection)
    try:
        for name in ("H", "H_p", "H_q", "g", "G", "step", *around, "rows", "mass", "lam"):
            linker.needed(name)
            reader.language(name)
    except Unreadable:
        return {}
    data = {"DATA": method.data[0], "FORM_DATA": method.data[1], "I": None}
    return {
        "problem": list(reader.of_problem.values()),
        "scheme": [(_title(module), list(texts.values())) for module, texts in reader.of_scheme.items()],
        "algebra": list(reader.of_algebra.values()),
        "constants": list(reader.known.values()),
        "data": {name: _rows(data[name]) for name in sorted(reader.data)},
        "about_data": _about(method) if "DATA" in reader.data else "",
        "weights": _rows(tuple(map(float, method.weights))) if len(method.weights) else "",
        "projected": bool(method.projection),
        "multistep": multistep,
    }


def _plain(ivp: ConstrainedIvp, method: Any) -> bool:
    """Return whether a step is one of vectors p and q of few entries, with solves and iterations in their usual form."""
    large = in_loops(ivp.facts) or ivp.arrays or ivp.singular == "least-squares"
    return not (large or method.form in MAPPED or method.compensated or method._asked or method.scheme_module.endswith(OUTER))


def _title(module: str) -> str:
    """Return the first line of the docstring of a file."""
    return str(ast.get_docstring(ast.parse(text_of(module)))).partition("\n")[0]


def _rows(x: Any) -> str:
    """Return the text of numbers in tuples, or of the identity."""
    return pformat(x, width=110) if isinstance(x, tuple) else "np.eye(D, dtype=REAL)"


def _about(method: Any) -> str:
    """Return the description of the numbers of a scheme."""
    numbers = getattr(method.member.numbers, "func", method.member.numbers)
    return (inspect.getdoc(numbers) or "").partition("\n")[0].removeprefix("Return ")
