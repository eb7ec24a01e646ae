"""The claims of a fixed-step method, measured on one initial value problem, one finding per claim.

A property that is claimed to hold exactly has to be zero up to rounding; the bounds are those of
:mod:`daebench.studies.claims.bench`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from daebench.diagnostics.order import SLACK
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import Code, method_of
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import OwnStart, given
from daebench.runs.request import Method, Told, silent
from daebench.runs.result import Table, tabular
from daebench.studies.claims.bench import FALLS_SHORT, NOT_APPLICABLE, NOT_CLAIMED, OK, UNDETERMINED, Checked, Finding
from daebench.studies.claims.declarations import declarations
from daebench.studies.claims.measured_run import bench_of, default_step
from daebench.studies.claims.second import on_second, unseen
from daebench.studies.measurable import PoissonScheme, claimed_order, measured
from daebench.studies.orders.series import Series
from daebench.studies.orders.study import study
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

STEPS = 200
"""Steps of the run along which what is kept is monitored, where none are given."""

NO_CLAIMS = "and makes no claims to check"
"""Message on a method that is not a fixed-step method."""


@dataclass(frozen=True)
class ClaimsMeasured(Checked):
    """The claims of a method on a problem, and their measurements."""

    ivp: Ivp
    """The problem."""
    method: str
    """Name of the method."""
    h: float
    """Step size of all but the order, s."""
    steps: int
    """Number of steps along which conserved quantities are monitored."""
    findings: tuple[Finding, ...]
    """One for each property."""

    @property
    def table(self) -> "pd.DataFrame":
        """One row a property."""
        return pd.DataFrame([asdict(finding) for finding in self.findings])

    @property
    def falls_short(self) -> list[str]:
        """Properties that are claimed and do not hold."""
        return [finding.property for finding in self.findings if finding.verdict == FALLS_SHORT]

    @property
    def status(self) -> int:
        """1 if a claim does not hold."""
        return int(bool(self.falls_short))

    def summary(self) -> dict[str, Any]:
        """Return the findings, for JSON."""
        claims = [asdict(finding) for finding in self.findings]
        return {
            **self.posed,
            "method": self.method,
            "h": self.h,
            "steps": self.steps,
            "claims": claims,
            "falls_short": self.falls_short,
            "unseen": unseen(self.ivp),
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield the findings, a row each, their notes, what the problem cannot show, and the claims that do not hold."""
        yield f"{self.method} on {self.ivp.problem}, case {self.ivp.case}, h = {self.h:g}, {self.steps} steps"
        yield Table(["property", "claimed", "measured", "bound", "verdict"], [_line(finding) for finding in self.findings])
        yield from (f"{finding.property}: {finding.note}" for finding in self.findings if finding.note)
        yield from unseen(self.ivp)
        if self.falls_short:
            yield f"{self.method} falls short of what it claims: {', '.join(self.falls_short)}."


def _line(finding: Finding) -> list[str]:
    """Return a finding in words: property, claim, number, bound and verdict."""
    order = finding.property.startswith("order")
    claimed = "" if finding.claimed is None else str(finding.claimed)
    measured, bound = f"{finding.measured:{'.3f' if order else '.2g'}}", f"> {finding.bound:.3g}" if order else f"<= {finding.bound:.2g}"
    spread = f" ± {finding.standard_error:.1g}" if np.isfinite(finding.standard_error) else ""
    return [
        finding.property,
        {"True": "yes", "False": "no"}.get(claimed, claimed),
        "" if np.isnan(finding.measured) else measured + spread,
        "" if np.isnan(finding.bound) else bound,
        finding.verdict,
    ]


@tabular
def check(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    method: Code | None = None,
    case: str | None = None,
    h: float | None = None,
    steps: int | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    progress: Told | None = None,
    **start: Unpack[OwnStart],
) -> Checked:
    """Measure the claims of a fixed-step method, or check the declarations of a problem.

    Where the force of the problem is the same everywhere, it cannot show where a scheme evaluates it: order, symmetry and two-form of a
    scheme are then measured on ``two_bodies_on_sphere`` as well, whose U has curvature. Code from outside knows one problem alone.

    Without a method the problem itself is checked, in all its cases or in one: initial values, mass matrix, second derivatives, first
    integrals, closed form, kinetic flow and chart; degrees of freedom are counted, and redundant constraints named.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, the path of a problem file, which is executed, or a definition.
    method : str or callable
        Name of a fixed-step method, for example rattle; if left out, the problem is checked. FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM
        are executed.
    case : str, optional
        Named initial values; by default the problem's first.
    h : float, optional
        Step size, s, of all but the order, which has its own step sizes; by default the largest 1, 2 or 5 times a power of ten
        up to a sixteenth of the mean of the first 64 steps of DOP853 at 1e-13, and up to 1 s.
    steps : int, optional
        Number of steps of the run along which conserved quantities are monitored; by default 200.
    parameters, options : mapping of str to float, optional
        Values of the problem's parameters, and free numbers of the method.
    anyway : bool
        Whether a scheme may run on a Poisson system for which it is not a Poisson integrator.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    progress : callable, optional
        Called with the fraction done and a label of the current task.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    DataFrame
        Columns property, claimed, measured, bound, verdict, standard_error and note, as
        :class:`daebench.studies.claims.bench.Finding` has them; of a problem case, what (was checked), fault and note.

    Raises
    ------
    BadInput
        If a name or number is invalid, or the method is not a fixed-step method.
    RunFailed
        If the run stops early at this step size.

    Examples
    --------
    >>> import daebench
    >>> findings = daebench.check("planar_pendulum", method="rattle")
    >>> findings["property"].tolist()  # doctest: +NORMALIZE_WHITESPACE
    ['order', 'symmetric', 'symplectic', 'Poisson in the chart', 'keeps g', 'keeps G H_p', 'keeps H',
     'order on two_bodies_on_sphere', 'symmetric on two_bodies_on_sphere', 'symplectic on two_bodies_on_sphere']
    >>> sorted(set(findings["verdict"]))
    ['not claimed', 'ok']
    """
    report = progress or silent
    if method is None:
        of_method = {"--h": h, "--steps": steps, "--option": options, "--anyway": anyway or None, "--on-singular": on_singular}
        if alone := next((name for name, value in of_method.items() if value is not None), ""):
            raise BadInput(f"{alone} belongs to the check of a method; add --method, or leave it out.", "check-option-of-method")
        if given(start):
            case = initial_value_problem(problem, case, parameters, consistent=False, **start).case
        return declarations(problem, case, parameters, report)
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    chosen = measured(method_of(ivp, method, options, anyway=anyway), ivp, NO_CLAIMS)
    value, count = default_step(ivp) if h is None else h, STEPS if steps is None else steps
    findings = check_claims(ivp, chosen, h=value, steps=count, progress=report)
    report(1.0, f"{chosen.name} on another problem")
    return ClaimsMeasured(ivp, chosen.name, value, count, (*findings, *on_second(ivp, chosen)))


def check_claims(
    ivp: Ivp,
    method: Method[Any, Any],
    *,
    h: float | None = None,
    steps: int = STEPS,
    halvings: int | None = None,
    progress: Told | None = None,
) -> list[Finding]:
    """Return the claims of a method on an initial value problem, and their measurements: the rows of :func:`check`, which has the errors.

    They are order, symmetry, symplecticity, in the problem's chart too where it declares one, both constraints, energy, and each first
    integral that the problem declares; of a Poisson system order, symmetry, whether it is a Poisson map, energy, each Casimir function and
    each first integral. ``h``, ``steps`` and ``halvings`` are as for :func:`check`; defects are those of at most 10 steps.
    """
    report = progress or silent
    fixed = measured(method, ivp, NO_CLAIMS)
    report(0.0, f"{fixed.name} on {ivp.problem}, {steps} steps")
    bench = bench_of(ivp, fixed, default_step(ivp) if h is None else h, steps)
    report(0.2, f"{fixed.name} on {ivp.problem}, defects")
    exact = bench.findings()
    order, _ = order_finding(ivp, fixed, halvings=halvings, began=lambda fraction, label: report(0.4 + 0.6 * fraction, f"order of {label}"))
    return [order, *exact]


def order_finding(
    ivp: Ivp,
    method: FixedStep | PoissonScheme | OutsideMethod,
    *,
    halvings: int | None = None,
    counts: Sequence[int] | None = None,
    began: Told | None = None,
) -> tuple[Finding, tuple[Series, ...]]:
    """Return the finding on the order of q and p, or y, and what the study found that it is read off.

    The order is that of the worse one; one that is round-off throughout counts for nothing. ``counts`` are the numbers of steps,
    in place of ``halvings``.
    """
    claimed, missing = claimed_order(method), float("nan")
    least = missing if claimed is None else claimed - SLACK
    if isinstance(method, FixedStep) and (instead := method.system.instead):
        note = f"it is {instead} whatever h is."
        return Finding("order", claimed, missing, missing, NOT_APPLICABLE, note=note), ()
    try:
        studied = study(ivp, [method], halvings=halvings, counts=counts, began=began).series
    except RunFailed as error:
        return Finding("order", claimed, missing, least, UNDETERMINED, note=str(error)), ()
    series = [curve for curve in studied if curve.component in ("q", "p", "y")]
    fitted_series = [curve for curve in series if np.isfinite(curve.fit.slope)]
    if not fitted_series or any(set(curve.fit.reasons) != {"round-off"} for curve in series if curve not in fitted_series):
        note = f"{'; '.join(map(_words, series))}. daebench order shows the points, and takes other step sizes and end times."
        return Finding("order", claimed, missing, least, UNDETERMINED, note=note), studied
    fit = min((curve.fit for curve in fitted_series), key=lambda fit: fit.slope)
    bound = least - 2 * fit.slope_error
    verdict = NOT_CLAIMED if claimed is None else OK if fit.slope > bound else FALLS_SHORT
    return Finding("order", claimed, fit.slope, bound, verdict, fit.slope_error, "; ".join(map(_words, series)) + "."), studied


def _words(series: Series) -> str:
    fit = series.fit
    if not np.isfinite(fit.slope):
        return f"{series.component}: {fit.note.rstrip('.')}"
    return f"{series.component}: {fit.slope:.3f} from {sum(fit.used)} of {len(fit.used)} step sizes"
