"""A problem file held against itself, at the initial values of a case: what is declared must be so, and a mistake is named.

What SymPy can see is refused when the definition is made, see ``definition_checks``. Here numbers decide, in double precision, at the
start and at a few points of the manifold around it.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from daebench import declared_checks, definition_checks, nearby
from daebench.cache import generated
from daebench.definition_checks import check_smooth
from daebench.diagnostics import consistency, manifold, metric, rank
from daebench.diagnostics.consistency import TOLERANCE
from daebench.diagnostics.manifold import residual_scales
from daebench.errors import DaebenchError, InvalidProblem
from daebench.make_scene import make_setting
from daebench.poisson_system import PoissonSystem
from daebench.scene import PoissonScene, Scene

MOST = 200
"""Most positions, or coordinates, of a problem whose declarations are checked at points around the start."""

SMOOTH, MASS, START = "twice differentiable at the start", "mass matrix positive definite", "initial values on the manifold"
RANK = "constraints independent at the start"
BASIC = (MASS, SMOOTH, START, RANK)
"""What must hold before anything else has a meaning."""

LEFT_TO_RUNS = (START, RANK)
"""What a run may be told to go on with: a start may be projected, and dependent constraints solved by least squares."""

Setting = Scene | PoissonScene
Check = Callable[[Any], str]


@dataclass(frozen=True)
class Held:
    """What was checked of a case.

    Parameters
    ----------
    case : str
        Name of the case.
    what : str
        What was checked.
    fault : str
        What is wrong, a sentence; "" where nothing is.
    """

    case: str
    what: str
    fault: str


def held(setting: Setting, tell: Callable[[str], None] = lambda what: None) -> list[Held]:
    """Return what was checked of a case as it is declared, and what is wrong, up to the first that makes the others meaningless.

    Parameters
    ----------
    setting : Scene or PoissonScene
        The case.
    tell : callable
        Told what is being checked, before it is.
    """
    declared = _declared(setting)
    found: list[Held] = []
    for what, check in _checks(declared).items():
        tell(what)
        try:
            with np.errstate(all="ignore"):
                fault = check(declared)
        except DaebenchError as error:
            text = str(error)
            fault = text if setting.problem in text else f"{setting.problem}, case {setting.case!r}: {text}"
        found.append(Held(setting.case, what, fault))
        if fault and what in BASIC:
            break
    return found


def require_sound(setting: Setting) -> None:
    """Accept a problem of which nothing is wrong at the case of a setting, but for what is left to runs; this is remembered in the cache.

    Raises
    ------
    InvalidProblem
        With the first fault.
    """

    def build(cached: bool) -> str:
        for each in held(setting):
            if each.fault and each.what not in LEFT_TO_RUNS:
                raise InvalidProblem(each.fault)
        return '"""Nothing is wrong."""'

    if setting.case in setting.sheet.CASES:
        generated(f"{setting.problem}_sound", f"{setting.source.key} case {setting.case} sound {_code()}", build)


@cache
def _code() -> str:
    """Return a digest of what decides the verdict here."""
    modules = (declared_checks, definition_checks, nearby, consistency, manifold, metric, rank)
    files = [Path(str(each)) for each in (__file__, *(module.__file__ for module in modules))]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def _declared(setting: Setting) -> Setting:
    """Return the case as it is declared: other parameters and initial values are not the file's mistake."""
    return make_setting(setting.source, setting.case) if setting.case in setting.sheet.CASES else setting


def _checks(setting: Setting) -> Mapping[str, Check]:
    """Return the checks that a problem is for, by what they check."""
    found: dict[str, Check] = {}
    if isinstance(setting, Scene) and setting.arrays:
        return {START: start}
    problem = setting.source.derivation.problem
    if isinstance(setting, PoissonScene):
        found[SMOOTH] = poisson_smooth
    else:
        found |= {MASS: mass, SMOOTH: smooth, START: start, RANK: independent}
    if setting.size > 2 * MOST or not hasattr(problem, "closed_form"):
        return found
    if isinstance(setting, Scene) and problem.integrals:
        found["first integrals"] = declared_checks.integrals
    if problem.closed_form is not None:
        found["closed form"] = declared_checks.closed_form
    for name in ("kinetic_flow", "chart"):
        if getattr(problem, name, None) is not None:
            found[name.replace("_", " ")] = getattr(declared_checks, name)
    return found


def start(scene: Scene) -> str:
    """Return which constraint the start does not meet, and by how much; "" where it meets them all."""
    state = tuple(scene.p0), tuple(scene.q0)
    scales = residual_scales(scene, scene.p0, scene.q0)
    for name, at, values, scale in (
        ("g", "q0", scene.value("g", state[1]), scales[0]),
        ("G H_p", "q0, p0", scene.value("Gv", *state), scales[1]),
    ):
        k = int(np.argmax(np.where(np.isfinite(values), np.abs(values), np.inf)))
        if not abs(values[k]) <= TOLERANCE * scale:
            text = f" = {_short(scene.source.derivation.g[k])}" if name == "g" and not scene.arrays else ""
            where = f"constraint {k + 1} of {scene.m}, {name}[{k}]{text}, is {values[k]:.3g} at {at} and not 0"
            return f"{scene.problem}, case {scene.case!r}: {where}; correct the case, or add --project to move it to the manifold."
    return ""


def independent(scene: Scene) -> str:
    """Return which constraints depend on others at the start; "" where none does, or the case asks for least squares."""
    why = None if scene.on_singular == "least-squares" else rank.dependence(scene)
    return f"{scene.problem}, case {scene.case!r}: G M^-1 G^T is singular at the start: {why}; {rank.REDUNDANT}." if why else ""


def mass(scene: Scene) -> str:
    """Return why the mass matrix is none at the start; "" where it is positive definite, or is not declared."""
    if scene.source.derivation.problem.M is None:
        return ""
    M = np.array(scene.source.derivation.M.subs(_values(scene)).tolist(), dtype=object)
    try:
        eigenvalues = np.linalg.eigvalsh(np.array(M, dtype=float))
    except (TypeError, ValueError, np.linalg.LinAlgError):
        return (
            f"{scene.problem}, case {scene.case!r}: the mass matrix M is no real matrix at q0: it is {M.tolist()}; correct M or the case."
        )
    if eigenvalues[0] > np.finfo(float).eps * len(M) * abs(eigenvalues[-1]):
        return ""
    what = "singular" if abs(eigenvalues[0]) <= 1e-12 * abs(eigenvalues[-1]) else "not positive definite"
    span = f"its eigenvalues are from {eigenvalues[0]:.3g} to {eigenvalues[-1]:.3g}"
    return f"{scene.problem}, case {scene.case!r}: the mass matrix M is {what} at q0: {span}; correct M or the parameters."


def smooth(scene: Scene) -> str:
    """Return which function of H or g, or which derivative of it, is no finite number at the start; "" where all are finite."""
    derivation = scene.source.derivation
    q, pq = (tuple(scene.q0),), (tuple(scene.p0), tuple(scene.q0))
    if derivation.explicit:
        functions: dict[str, tuple[Any, ...]] = {"H": pq, "H_p": pq, "H_q": pq, "H_pp": pq, "H_qp": pq, "H_qq": pq}
    else:
        qv = (*q, (1.0,) * scene.d)
        functions = {"U": q, "U_q": q, "U_qq": q, "M": q, "N": qv, "T_qq": qv}
    functions |= {"g": q, "G": q, "curvature": (*q, (1.0,) * scene.m)}
    for name, arguments in functions.items():
        if not np.all(np.isfinite(scene.value(name, *arguments))):
            what = name if "_" not in name else f"the derivative {name}"
            what = {"G": "the derivative g_q", "curvature": "the second derivative of g", "N": "the derivative of M"}.get(name, what)
            return (
                f"{scene.problem}, case {scene.case!r}: {what} is no finite number at the start; correct the case, or write it otherwise."
            )
    return ""


def poisson_smooth(scene: PoissonScene) -> str:
    """Return which function of a Poisson system is no finite number at the start; "" where all are finite."""
    problem = scene.source.derivation.problem
    if isinstance(problem, PoissonSystem):
        check_smooth("H", problem.H, problem.y)
        check_smooth("B", problem.B, problem.y)
    functions = {"H": "H", "field": "B grad H"} | ({} if scene.arrays else {"field_y": "the derivative of B grad H"})
    for name, what in functions.items():
        if not np.all(np.isfinite(scene.value(name, scene.y0 if scene.arrays else tuple(scene.y0)))):
            return f"{scene.problem}, case {scene.case!r}: {what} is no finite number at y0; correct the case, or write it otherwise."
    return ""


def _values(scene: Scene) -> dict[Any, float]:
    problem = scene.source.derivation.problem
    named = {symbol: scene.parameters[str(symbol)] for symbol in problem.parameters}
    return dict(zip(problem.q, map(float, scene.q0), strict=True)) | named


def _short(expression: Any) -> str:
    text = str(expression)
    return text if len(text) <= 80 else f"{text[:77]}..."
