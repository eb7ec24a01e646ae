"""``daebench.baumgarte``: the effect of stabilisation on energy, constraints and cost, and the limits of stability."""

from collections.abc import Callable, Mapping, Sequence
from itertools import count, product
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np

from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.freedom import dependence
from daebench.errors import BadInput, positive
from daebench.methods.fixed_step.parts import takes_form
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import require_constraints, require_positions
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Progress
from daebench.studies.baumgarte.cells import (
    SLOWEST,
    Cell,
    cell,
    contraction,
    fastest,
    fixed_options,
    limit,
    measured_limit,
    over,
    run_of,
    usable,
)
from daebench.studies.baumgarte.result import USUAL, BaumgarteMap, Effect, Limit, least
from daebench.studies.claims.measured_run import default_step

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian

SCHEMES = ("rk4", "gauss2")
"""Schemes that are mapped where none are given."""

TOLERANCES = (1e-6, 1e-9)
"""Tolerances of IDA."""

VALUES = tuple(10.0 ** (k / 4) for k in range(-12, 4))
"""alpha h and beta h of the map."""

RATES = tuple(10.0 ** (k / 2) for k in range(-1, 8))
"""alpha and beta of IDA's map, 1/s."""

RATIOS = (1.0, 3.0, 0.3)
"""beta over alpha of the rays on which the limit of stability is measured."""

STATES = 4096
"""States that the verdict on the energy is taken from, about."""


def baumgarte(
    problem: "str | ConstrainedHamiltonian | InitialValueProblem",
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    h: float | None = None,
    t_end: float = 10.0,
    methods: Sequence[str] = (*SCHEMES, "rattle"),
    tolerances: Annotated[Sequence[float], Option("--tol")] = TOLERANCES,
    values: Sequence[float] = VALUES,
    rates: Sequence[float] = RATES,
    on_singular: str | None = None,
    progress: Progress | None = None,
    **start: Unpack[OwnStart],
) -> BaumgarteMap:
    """Map the effect of stabilisation on energy, constraints and cost, and the limits of stability.

    A scheme is run on Baumgarte's equation over all alpha h and beta h, on soft constraints with the same roots and an impedance of 0.9,
    and on a penalty in place of the constraint over its stiffness; IDA is run over alpha, beta and the tolerance. Methods that satisfy the
    constraints without stabilisation, such as RATTLE, are run once for comparison::

        >>> import daebench
        >>> found = daebench.baumgarte("planar_pendulum", t_end=2.0, methods=["rk4"], tolerances=[], values=[0.01, 0.1, 1.0])
        >>> critical = found.limits[0]
        >>> round(critical.predicted, 3), abs(critical.measured / critical.predicted - 1) < 0.1
        (2.785, True)

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    h : float, optional
        Step size, s; by default a small part of the motion.
    t_end : float
        End of the runs, s.
    methods : sequence of str
        Schemes to map, such as rk4 and gauss2, and fixed-step methods for comparison, such as rattle.
    tolerances : sequence of float
        Tolerances of IDA.
    values : sequence of float
        alpha h and beta h of the maps.
    rates : sequence of float
        alpha and beta of IDA's maps, 1/s.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    progress : callable, optional
        Called with the fraction of the work done.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    BaumgarteMap

    Raises
    ------
    BadInput
        If no method is a scheme that can be stabilised, a number is invalid, or the problem is a Poisson system, has arrays as vectors, or
        has constraints that depend on others at the start, unless ``on_singular`` is "least-squares".
    """
    ivp = _problem(problem, case, parameters, on_singular=on_singular, **start)
    for name, numbers in (("tolerances", tolerances), ("values", values), ("rates", rates)):
        for x in numbers:
            positive(name, x)
    mapped = _stabilised(methods)
    h = default_step(ivp) if h is None else positive("h", h)
    t_end = positive("t_end", t_end)
    others = [name for name in methods if name not in mapped]
    for name in others:
        if method_of(ivp, name).knob != "h":
            raise BadInput(f"{name} chooses its own steps; give fixed-step methods, for example rattle.", "stabilise-own-steps")
    tell = _counted(progress, (len(mapped) + 1) * len(values) ** 2 + len(values) + len(tolerances) * len(rates) ** 2)
    names = [*(f"baumgarte:{scheme}" for scheme in mapped), f"soft:{mapped[0]}"]
    maps = {name: over(ivp, name, h, t_end, _roots(name, h, values), tell) for name in names}
    rate = fastest(ivp)
    pairs = [{"alpha": alpha, "beta": beta} for alpha, beta in product(rates, rates)]
    return BaumgarteMap(
        ivp,
        h,
        t_end,
        maps,
        over(ivp, f"stiff:{mapped[0]}", h, t_end, [{"eps": h * rate / x} for x in values], tell),
        {tol: over(ivp, "ida:baumgarte", tol, t_end, pairs, tell) for tol in tolerances},
        [_effect_of(ivp, scheme, h, t_end, maps[f"baumgarte:{scheme}"], values) for scheme in mapped],
        [_limit(ivp, scheme, h, ratio) for scheme in mapped for ratio in RATIOS],
        [cell(ivp, name, h, t_end, {}) for name in others],
    )


def _stabilised(methods: Sequence[str]) -> list[str]:
    """Return the methods that can be stabilised; refuse methods of which none can be."""
    fit = takes_form("baumgarte")
    mapped = [name for name in methods if name in fit]
    if not mapped:
        raise BadInput(
            f"none of {', '.join(methods) or 'no methods'} can be stabilised; give at least one of {', '.join(fit)}.",
            "no-method-to-stabilise",
        )
    return mapped


def _problem(problem: Any, *numbers: Any, **more: Any) -> ConstrainedIvp:
    """Return the problem; refuse one whose constraints cannot be stabilised."""
    ivp = require_constraints(initial_value_problem(problem, *numbers, **more), "which has no constraints to stabilise")
    require_positions(ivp, "for which there are no soft constraints and penalties to map; run baumgarte:rk4 or ida:baumgarte on it")
    if ivp.arrays:
        raise BadInput(f"{ivp.problem}, case {ivp.case}, is held as arrays; choose another problem or case.", "stabilise-arrays")
    if not ivp.singular and (why := dependence(ivp)):
        raise BadInput(
            f"{ivp.problem}, case {ivp.case}, cannot be stabilised: G M^-1 G^T is singular at the start, where {why}.", "stabilise-singular"
        )
    return ivp


def _roots(name: str, h: float, values: Sequence[float]) -> list[Mapping[str, float]]:
    """Return the free numbers of a method over all alpha h (slowest) and beta h."""
    return [fixed_options(name.partition(":")[0], h, a, b) for a, b in product(values, values)]


def _counted(progress: Progress | None, of: int) -> Callable[[], None]:
    """Return the function that is called after each run, and tells the part of them that is done."""
    done = count(1)
    return lambda: progress(next(done) / of) if progress else None


def _effect_of(ivp: ConstrainedIvp, scheme: str, h: float, t_end: float, cells: Sequence[Cell], values: Sequence[float]) -> Effect:
    usual = {"alpha": USUAL, "beta": USUAL}
    every = max(1, int(t_end / h) // STATES)
    drifts = []
    for name, options in ((scheme, {}), (f"baumgarte:{scheme}", usual)):
        drifts.append(energy_verdict(ivp, run_of(ivp, name, h, t_end, options, every=every)))
    a, b = np.meshgrid(values, values, indexing="ij")
    stable = usable(scheme, a, b).ravel()
    among = [one for one, fine in zip(cells, stable, strict=True) if fine and not one.failure] or list(cells)
    without, at_usual = cell(ivp, scheme, h, t_end, {}), cell(ivp, f"baumgarte:{scheme}", h, t_end, usual)
    return Effect(scheme, without, at_usual, drifts[0], drifts[1], least(among), max(among, key=lambda one: one.energy))


def _limit(ivp: ConstrainedIvp, scheme: str, h: float, ratio: float) -> Limit:
    predicted = limit(scheme, ratio)
    here = np.array(predicted * 1.01), np.array(ratio * predicted * 1.01)
    by = "" if predicted == float("inf") else "growth" if contraction(scheme, *here) < SLOWEST else "iteration"
    return Limit(scheme, ratio, predicted, measured_limit(ivp, scheme, h, ratio), by)
