"""``daebench.generate``: a fixed-step method on a problem as code of one's own."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from daebench.compiler.print.languages import INTEGRATORS, KEYWORDS, unknown_language
from daebench.compiler.trace.ir import FLOAT32
from daebench.errors import BadInput, unknown
from daebench.methods.catalogue import find_problem
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.pages.docstrings import docstring, meanings
from daebench.pages.generation import sentences
from daebench.pages.generation.check import STEPS, checked, request
from daebench.pages.generation.compiled import ABOUT
from daebench.pages.generation.languages import LANGUAGES, Language
from daebench.runs.files import require_new
from daebench.runs.ivp import Ivp
from daebench.runs.members import flat
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart
from daebench.runs.request import PRECISIONS
from daebench.runs.result import Result
from daebench.systems.lazily import jinja2

if TYPE_CHECKING:
    from daebench.pages.generation.linked import Linked

BESIDE = ("README.md", "LICENSE")
"""Files besides them."""

SCALES = {"scale_length": "length of the motion: the largest |q| of the start", "scale_rate": "1/s, rate of the motion at the start"}
"""Scales of the start that stand among the parameters, and their meaning."""

OF_PRECISION = {
    "real": ("double", "float"),
    "real_of_numpy": ("float64", "float32"),
    "wide": ("", "(double)"),
    "f": ("", "f"),
}
"""Words of languages for double and for single precision."""


@dataclass(frozen=True)
class Generated(Result):
    """Generated code.

    Parameters
    ----------
    files : list of Path
        Its files.
    error : float
        Largest error at the times of its check, in the unit of a position.
    """

    files: list[Path]
    error: float

    def summary(self) -> dict[str, Any]:
        """Return the error and the paths."""
        return {"error": self.error, "written": [*map(str, self.files)]}

    def printed(self) -> Iterator[str]:
        """Yield the paths."""
        yield f"written: {', '.join(map(str, self.files))}"


def generate(
    problem: str,
    method: str,
    out: str | Path,
    *,
    h: float,
    language: str = "c",
    precision: str = "float64",
    name: str | None = None,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    overwrite: Annotated[bool, Option("--overwrite")] = False,
    **start: Unpack[OwnStart],
) -> Generated:
    """Write a fixed-step method on a problem as code that needs nothing but a compiler.

    Parameters
    ----------
    problem : str
        Name, as for :func:`daebench.run`.
    method : str
        Name of a fixed-step method, for example rattle.
    out : str or Path
        New folder for the code.
    h : float
        Step size, s, for which the code is checked. Its functions take any.
    language : str
        "c": C99, which C++ can include, and a loader of the compiled library for Python. "cpp": a header of C++17 with one class.
        "javascript": an ES module, with types and a page. "python": a file that needs NumPy alone.
    precision : str
        Number type of the code, as for :func:`daebench.run`: "float64", or, but for JavaScript, "float32" or "mixed".
    name : str, optional
        Beginning of all names in the code; by default that of problem and method.
    case : str, optional
        Initial values and parameters that the code begins with.
    parameters, options : mapping of str to float, optional
        Parameters of the problem, and options of the method.
    anyway : bool
        Whether a scheme is taken for a structure matrix B for which it is no Poisson integrator.
    on_singular : str, optional
        What is done where G loses rank; "least-squares" leaves out constraints that depend on others.
    overwrite : bool
        Whether files in a folder that is there are replaced.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    Generated
        Its ``files``, and the ``error`` of the method at the times of the check.

    Raises
    ------
    BadInput
        If the method has no fixed step or stops early, the name is no identifier, the folder is there, or the language has no numbers of
        that precision.

    Examples
    --------
    >>> import daebench, tempfile
    >>> code = daebench.generate("spherical_pendulum", "rattle", f"{tempfile.mkdtemp()}/pendulum", h=0.01)
    >>> sorted(file.name for file in code.files)[-1]
    'spherical_pendulum_rattle.h'
    """
    _require_numbers(language, precision)
    folder = Path(out)
    if not overwrite:
        require_new(folder)
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    chosen = method_of(ivp, method, options, anyway=anyway)
    if not isinstance(chosen, FixedStepMethod):
        raise BadInput(
            f"{method} has no fixed step, so that it cannot be generated; choose a scheme such as rattle.", "generate-without-fixed-step"
        )
    if ivp.on_manifold and ivp.arrays:
        raise BadInput(
            f"{ivp.problem} with {ivp.facts.NODES} nodes is computed in arrays, for which no code can be generated; take fewer nodes.",
            "too-many-nodes-to-generate",
        )
    chosen.check(ivp, request(h, precision))
    named = _name(name, ivp, chosen)
    facts = _facts(ivp, chosen, h, precision, LANGUAGES[language]) | {"name": named, "NAME": named.upper()}
    texts: dict[Path, str] = {}
    for file in (*LANGUAGES[language].files, *BESIDE):
        # A page has the module inline, because browsers load none from a file.
        module = texts.get(folder / f"{named}.mjs", "").replace("\nexport ", "\n")
        texts[folder / file.replace("kernel", named)] = _rendered(language, file, facts | {"module": module})
    if language == "c":
        texts[folder / ABOUT] = json.dumps(_about(ivp, chosen, facts), indent=1) + "\n"
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
    return Generated(list(texts), facts["reference"]["error"])


def _require_numbers(language: str, precision: str) -> None:
    """Accept a language that has numbers of this precision; raise :class:`BadInput` otherwise."""
    if language not in INTEGRATORS:
        raise unknown_language(language)
    if precision not in PRECISIONS:
        raise unknown("precision", precision, PRECISIONS)
    if language == "javascript" and precision != "float64":
        raise BadInput(
            f"JavaScript computes in double precision alone, and {precision} would only make it slower; choose float64.",
            "javascript-precision",
        )


def _about(ivp: Ivp, method: FixedStepMethod[Any, Any], facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the description of a folder, with which it can be certified."""
    constrained = ivp.on_manifold
    claims = sentences.claims(ivp, method) if constrained else {}
    return {
        "name": facts["name"],
        "on": f"{ivp.problem}:{ivp.case}",
        "method": method.name,
        "h": float(facts["h"]),
        "precision": facts["precision"],
        "claims": claims,
        "callable": facts["callable"],
    }


def _name(name: str | None, ivp: Ivp, method: FixedStepMethod[Any, Any]) -> str:
    """Return the beginning of all names."""
    if name is None:
        return sentences.identifiers(["".join(x if x.isalnum() else "_" for x in f"{Path(ivp.problem).stem}_{method.name}")])[0]
    if not sentences.IDENTIFIER.fullmatch(name) or name in KEYWORDS or name in ("check", "example", "main"):
        raise BadInput(f"{name!r} cannot name functions and files of C; choose letters, digits and _, and no keyword.", "not-a-name-in-c")
    return name


def _rendered(language: str, file: str, facts: Mapping[str, Any]) -> str:
    folder = resources.files("daebench.pages.generation") / "templates"
    loader = jinja2.FileSystemLoader([str(folder / language), str(folder / "common")])
    environment = jinja2.Environment(
        loader=loader, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    return environment.get_template(f"{file}.jinja").render(**facts)


def _facts(ivp: Ivp, method: FixedStepMethod[Any, Any], h: float, precision: str, language: Language) -> dict[str, Any]:
    """Return the values that templates name."""
    # Which import SymPy.
    from daebench.pages.generation.lesson import lesson
    from daebench.pages.generation.linked import linked

    code = linked(ivp, method, h, language.longest, precision)
    file = find_problem(ivp.problem)

    def number(x: float) -> str:
        return language.number(x, code.real)

    parameters = sentences.parameters_of(ivp, meanings(docstring(file.path.read_text(encoding="utf-8"))))
    parameters += [{"name": name, "value": value, "about": SCALES[name]} for name, value in zip(SCALES, code.scales, strict=True)]
    parameters = [parameter | {"text": number(parameter["value"])} for parameter in parameters]
    order, claims, source = sentences.claimed(ivp, method)
    return {
        "problem": ivp.problem,
        "case": ivp.case,
        "method": method.name,
        "kind": ivp.facts.KIND,
        "h": repr(h),
        "order": order,
        "claims": claims,
        "source": source,
        "version": version("daebench"),
        "precision": precision,
        "precision_words": PRECISIONS[precision],
        "asked": "" if precision == "float64" else f" --precision {precision}",
        **{name: words[code.real == FLOAT32] for name, words in OF_PRECISION.items()},
        "step_size": number(h),
        "infinity": number(math.inf),
        "callable": _callable(ivp, code),
        "summary": sentences.commented(file.summary),
        "definition": sentences.definition(ivp),
        "parameters": parameters,
        "forced": bool(getattr(ivp.facts, "FORCED", False)),
        "extended": int(getattr(ivp.facts, "EXTENDED", 0)),
        "redundant": ivp.singular == "least-squares",
        "statuses": sentences.statuses(method._reasons(ivp)),
        **_sizes(ivp, code),
        "functions": language.functions(code),
        "entering": code.entering,
        "lesson": language.readable and lesson(ivp, method, [parameter["name"] for parameter in parameters]),
        **{f"start_{of}": ", ".join(map(repr, map(float, x))) for of, x in zip("pq", ivp.start, strict=False)},
        "start": ", ".join(map(number, flat(code.state))),
        "defaults": ", ".join(parameter["text"] for parameter in parameters),
        "reference": checked(ivp, method, h, precision, language),
        "steps_per_row": STEPS,
    }


def _callable(ivp: Ivp, code: "Linked") -> bool:
    """Return whether the library can be called step by step, in numbers of double precision."""
    return ivp.on_manifold and not code.scheme.memory and code.real != FLOAT32


def _sizes(ivp: Ivp, code: "Linked") -> dict[str, Any]:
    numbers = sum(len(vector) for vector in ivp.start)
    sizes = {"state": code.scheme.state, "memory": code.scheme.memory, "multipliers": code.scheme.multipliers, "own": numbers}
    if not ivp.on_manifold:
        return sizes | {"n": numbers, "shown": min(numbers, 6), "constraints": [], "has_momenta": False}
    constraints = sentences.multipliers(ivp.source.define())
    has = any("momenta" in part.functions for part in code.problem)
    return sizes | {
        "conditions": sentences.conditions(ivp),
        "d": ivp.d,
        "m": ivp.m,
        "shown": min(ivp.d, 6),
        "constraints": constraints,
        "has_momenta": has,
    }
