"""Check of a problem file at the initial values of a case: declarations must be true, and the message names a mistake.

What SymPy can see is refused when the definition is made, see ``definition_checks``. Here numbers decide, in double precision, at the
start and at a few points of the manifold around it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.compiler.cache import generated
from daebench.diagnostics.consistency import allowed
from daebench.diagnostics.contradiction import contradiction
from daebench.diagnostics.freedom import dependence, freedom, require_freedom, undetermined
from daebench.diagnostics.integrability import integrability
from daebench.diagnostics.inverse_mass import inverse_mass
from daebench.diagnostics.problem import declared as declared_checks
from daebench.diagnostics.second_order import require_motion
from daebench.errors import DaebenchError, InvalidProblem
from daebench.runs.ivp import ConstrainedIvp, Ivp, PoissonIvp
from daebench.runs.make_ivp import make_ivp
from daebench.systems.files.package import digest_of_packages

MOST = 200
"""Most positions, or coordinates, of a problem whose declarations are checked at points around the start."""

SMOOTH, MASS, START = "twice differentiable at the start", "mass matrix positive definite", "initial values on the manifold"
HESSIAN = "multipliers determined by H_pp"
RANK = "constraints independent at the start"
BASIC = (MASS, HESSIAN, SMOOTH, START, RANK)
"""Checks without which the others have no meaning."""

LEFT_TO_RUNS = (START, RANK)
"""Mistakes that a run may accept: a start may be projected, and dependent constraints solved by least squares."""

DECIDING = ("diagnostics", "systems")
"""Packages on which the check of a problem depends. They are whole packages, so that no file is forgotten."""

Check = Callable[[Any], str]


@dataclass(frozen=True)
class Held:
    """One check of a case.

    Parameters
    ----------
    case : str
        Name of the case.
    what : str
        What was checked.
    fault : str
        The mistake, as a sentence; "" if there is none.
    note: str
        Another result, as a sentence: degrees of freedom.
    """

    case: str
    what: str
    fault: str
    note: str = ""


def held(ivp: Ivp, tell: Callable[[str], None] = lambda what: None, *, noted: bool = True) -> list[Held]:
    """Return the checks of a case, with their results, up to the first mistake that makes the others meaningless.

    Parameters
    ----------
    ivp : Ivp
        The case.
    tell : callable
        Called with the name of each check before it begins.
    noted : bool
        Whether further results are wanted.
    """
    findings: list[Held] = []
    for what, check in _checks(ivp).items():
        tell(what)
        try:
            with np.errstate(all="ignore"):
                fault = check(ivp)
        except DaebenchError as error:
            text = str(error)
            fault = text if ivp.problem in text else f"{ivp.problem}, case {ivp.case!r}: {text}"
        note = NOTES[what](ivp) if noted and what in NOTES and ivp.on_manifold else ""
        findings.append(Held(ivp.case, what, fault, note))
        if fault and what in BASIC:
            break
    return findings


def require_sound(ivp: Ivp) -> None:
    """Accept a case of a problem without mistakes, except those that a run may accept; the result is cached.

    Raises
    ------
    InvalidProblem
        With the first fault.
    """

    def build() -> str:
        # With the numbers of the file: those that a caller gives are not its mistake.
        for finding in held(make_ivp(ivp.source, ivp.case), noted=False):
            if finding.fault and finding.what not in LEFT_TO_RUNS:
                raise InvalidProblem(finding.fault, "problem-check-failed", check=finding.what)
        # Only a sound case is cached: a mistake is found again, with its message, until the file is corrected.
        return '"""Nothing is wrong."""'

    if ivp.case in ivp.facts.CASES:
        generated(f"{ivp.problem}_sound", f"{ivp.source.key} case {ivp.case} sound {digest_of_packages(*DECIDING)}", build)


def _checks(ivp: Ivp) -> Mapping[str, Check]:
    """Return the checks for a problem, by name."""
    checks: dict[str, Check] = {}
    if ivp.on_manifold and ivp.arrays:
        return {START: start}
    problem = ivp.source.derivation.problem
    if not ivp.on_manifold:
        checks[SMOOTH] = poisson_smooth
    else:
        checks |= {HESSIAN: multipliers} if problem.M is None else {MASS: mass}
        checks |= {SMOOTH: smooth, START: start, RANK: independent}
        checks = checks if ivp.m else {what: check for what, check in checks.items() if what in (MASS, SMOOTH)}
    if ivp.size > 2 * MOST or not hasattr(problem, "closed_form"):
        return checks
    if ivp.on_manifold and problem.integrals:
        checks["first integrals"] = declared_checks.integrals
    if problem.closed_form is not None:
        checks["closed form"] = declared_checks.closed_form
    for name in ("kinetic_flow", "chart"):
        if getattr(problem, name, None) is not None:
            checks[name.replace("_", " ")] = getattr(declared_checks, name)
    return checks


def start(ivp: ConstrainedIvp) -> str:
    """Return a sentence on the constraint that the start violates, with its residual; "" if it satisfies all of them."""
    state = tuple(ivp.p0), tuple(ivp.q0)
    scales = allowed(ivp)
    for name, at, values, scale in (
        ("g", "q0", ivp.value("g", state[1]), scales[0]),
        ("G H_p", "q0, p0", ivp.value("Gv", *state), scales[1]),
    ):
        # A value that is not finite is the worst of all.
        k = int(np.argmax(np.where(np.isfinite(values), np.abs(values), np.inf)))
        # "not <=", so that NaN is a mistake.
        if not abs(values[k]) <= scale:
            if name == "g" and (why := contradiction(ivp)):
                return why
            text = f" = {_short(ivp.source.derivation.g[k])}" if name == "g" and not ivp.arrays else ""
            words = f"{ivp.words(k)}, " if ivp.words(k) else ""
            where = f"constraint {k + 1} of {ivp.m}, {words}{name}[{k}]{text}, is {values[k]:.3g} at {at} and not 0"
            return f"{ivp.problem}, case {ivp.case!r}: {where}; correct the case, or add --project to move it to the manifold."
    return ""


def independent(ivp: ConstrainedIvp) -> str:
    """Return the constraints that depend on others at the start; "" if there are none, or if the case uses least squares.

    Raises
    ------
    BadInput
        If constraints leave no freedom there, or no motion has the velocity of the start.
    """
    require_freedom(ivp)
    require_motion(ivp)
    why = None if ivp.on_singular == "least-squares" else dependence(ivp)
    return f"{ivp.problem}, case {ivp.case!r}: G M^-1 G^T is singular at the start: {why}." if why else ""


def _counted(ivp: ConstrainedIvp) -> str:
    """Return the degrees of freedom at the start, redundant constraints with their expressions, and those on velocities that integrate."""
    counted = freedom(ivp)
    if counted is None:
        return ""
    count = counted.count
    if ivp.nonholonomic:
        integrable = integrability(ivp)
        count += f"; {integrable.words if integrable else 'whether constraints on velocities are on positions is not examined'}"
    rows = [*ivp.source.derivation.problem.g, *ivp.source.derivation.problem.velocity]
    written = "; ".join(f"{ivp.named(k)}{': ' if ivp.words(k) else ' = '}{_short(rows[k])}" for k in counted.others)
    return f"{count}; {counted.named}, {counted.where} ({written})" if counted.others else count


def mass(ivp: ConstrainedIvp) -> str:
    """Return why the mass matrix is not valid at the start; "" if it is positive definite."""
    M = np.array(ivp.source.derivation.M.subs(_values(ivp)).tolist(), dtype=object)
    try:
        eigenvalues = np.linalg.eigvalsh(np.array(M, dtype=float))
    except (TypeError, ValueError, np.linalg.LinAlgError):
        return f"{ivp.problem}, case {ivp.case!r}: the mass matrix M is not a real matrix at q0: it is {M.tolist()}; correct M or the case."
    if eigenvalues[0] > np.finfo(float).eps * len(M) * abs(eigenvalues[-1]):
        return ""
    what = "singular" if abs(eigenvalues[0]) <= 1e-12 * abs(eigenvalues[-1]) else "not positive definite"
    span = f"its eigenvalues are from {eigenvalues[0]:.3g} to {eigenvalues[-1]:.3g}"
    return f"{ivp.problem}, case {ivp.case!r}: the mass matrix M is {what} at q0: {span}; correct M or the parameters."


def multipliers(ivp: ConstrainedIvp) -> str:
    """Return why H_pp does not determine the multipliers at the start; "" where it does, or where values are not finite."""
    fault = undetermined(ivp)
    return f"{ivp.problem}, case {ivp.case!r}: {fault}." if fault else ""


def _unusual(ivp: ConstrainedIvp) -> str:
    """Return the sentence on an unusual H_pp at the start; "" where it is as usual."""
    try:
        inverse = inverse_mass(ivp, ivp.p0, ivp.q0)
    except np.linalg.LinAlgError:
        return ""
    return "" if inverse.fault else inverse.note


NOTES = {RANK: _counted, HESSIAN: _unusual}
"""Notes that are reported with a check, whether or not there is a fault."""


def smooth(ivp: ConstrainedIvp) -> str:
    """Return the function of H or g, or its derivative, that is not finite at the start; "" if all are finite."""
    derivation = ivp.source.derivation
    q, pq = (tuple(ivp.q0),), (tuple(ivp.p0), tuple(ivp.q0))
    if derivation.explicit:
        functions: dict[str, tuple[Any, ...]] = {"H": pq, "H_p": pq, "H_q": pq, "H_pp": pq, "H_qp": pq, "H_qq": pq}
    else:
        qv = (*q, (1.0,) * ivp.d)
        functions = {"U": q, "U_q": q, "U_qq": q, "M": q, "N": qv, "T_qq": qv}
    functions |= {"g": q, "G": q, "curvature": (*q, (1.0,) * ivp.m)}
    for name, arguments in functions.items():
        if not np.all(np.isfinite(ivp.value(name, *arguments))):
            what = name if "_" not in name else f"the derivative {name}"
            what = {"G": "the derivative g_q", "curvature": "the second derivative of g", "N": "the derivative of M"}.get(name, what)
            return f"{ivp.problem}, case {ivp.case!r}: {what} is not finite at the start; correct the case, or rewrite the expression."
    return ""


def poisson_smooth(ivp: PoissonIvp) -> str:
    """Return the function of a Poisson system that is not finite at the start; "" if all are finite."""
    problem = ivp.source.derivation.problem
    from daebench.systems.constrained_checks import check_smooth  # which imports SymPy

    check_smooth("H", problem.H, problem.y)
    check_smooth("B", problem.B, problem.y)
    functions = {"H": "H", "field": "B grad H"} | ({} if ivp.arrays else {"field_y": "the derivative of B grad H"})
    for name, what in functions.items():
        if not np.all(np.isfinite(ivp.value(name, ivp.y0 if ivp.arrays else tuple(ivp.y0)))):
            return f"{ivp.problem}, case {ivp.case!r}: {what} is not finite at y0; correct the case, or rewrite the expression."
    return ""


def _values(ivp: ConstrainedIvp) -> dict[Any, float]:
    problem = ivp.source.derivation.problem
    named = {symbol: ivp.parameters[str(symbol)] for symbol in problem.parameters}
    return dict(zip(problem.q, map(float, ivp.q0), strict=True)) | named


def _short(expression: Any) -> str:
    text = str(expression)
    return text if len(text) <= 80 else f"{text[:77]}..."
