"""``daebench.baumgarte``: the effect of stabilisation on energy, constraints and cost, and the limits of stability."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.freedom import dependence
from daebench.errors import BadInput, positive
from daebench.methods.fixed_step.parts import takes_form
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.option import Option
from daebench.runs.request import Progress
from daebench.runs.result import Result, Table
from daebench.studies.baumgarte.cells import Cell, cell, frame, measured_limit, over_step, over_tolerance, penalised, run_of
from daebench.studies.baumgarte.limits import SLOWEST, contraction, limit, usable
from daebench.studies.claims.measured_run import default_step

if TYPE_CHECKING:
    import pandas as pd

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

USUAL = 10.0
"""alpha and beta that ``baumgarte`` has where none are given, 1/s."""

RATIOS = (1.0, 3.0, 0.3)
"""beta over alpha of the rays on which the limit of stability is measured."""

STATES = 4096
"""States that the verdict on the energy is taken from, about."""


@dataclass(frozen=True)
class Limit:
    """Where a scheme becomes unstable on a ray beta = ratio alpha.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    ratio : float
        beta over alpha.
    predicted, measured : float
        alpha h there, by the roots of s^2 + 2 alpha s + beta^2, and by runs; infinite where there is none.
    by : str
        "growth": g grows, or "iteration": the stages are no longer found in the iterations that there are.
    """

    scheme: str
    ratio: float
    predicted: float
    measured: float
    by: str


@dataclass(frozen=True)
class Effect:
    """Effect of the usual stabilisation on the energy of a run.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    without, usual : Cell
        The runs without stabilisation, and with alpha = beta = 10/s.
    drift_without, drift_usual : Drift
        Verdicts on their energies.
    least, most : Cell
        The runs of the map with the least and the largest energy error, among those that the prediction calls stable.
    """

    scheme: str
    without: Cell
    usual: Cell
    drift_without: Drift
    drift_usual: Drift
    least: Cell
    most: Cell

    @property
    def ratio(self) -> float:
        """Energy error with the usual stabilisation over that without."""
        return self.usual.energy / self.without.energy if self.without.energy > 0 else float("nan")


@dataclass(frozen=True)
class BaumgarteMap(Result):
    """Maps of stabilised constraints over their parameters.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    h, t_end : float
        Step size and end of the runs, s.
    maps : mapping of str to list of Cell
        Runs over alpha h (slowest) and beta h by method, such as "baumgarte:rk4" and "soft:rk4".
    penalty : list of Cell
        Runs on the penalised system over h times its fastest frequency.
    tolerant : mapping of float to list of Cell
        Runs of ``ida:baumgarte`` over alpha and beta, 1/s, by tolerance.
    effects : sequence of Effect
        Effect of the usual stabilisation on the energy, by scheme.
    limits : sequence of Limit
        Limits of stability.
    beside : sequence of Cell
        Methods that have no alpha and beta, with the same step.
    """

    drawn_by: ClassVar[str] = "daebench.studies.baumgarte.figure"
    stem: ClassVar[str] = "baumgarte"

    ivp: ConstrainedIvp
    h: float
    t_end: float
    maps: Mapping[str, Sequence[Cell]]
    penalty: Sequence[Cell]
    tolerant: Mapping[float, Sequence[Cell]]
    effects: Sequence[Effect]
    limits: Sequence[Limit]
    beside: Sequence[Cell] = field(default_factory=tuple)

    @property
    def answer(self) -> str:
        """Whether the stabilisation affects the energy, in three sentences."""
        first = self.effects[0]
        exact = "On the exact motion G v = 0, and the forces of the stabilisation do no work."
        of = f"With {first.scheme}, h = {self.h:g} s, to t = {self.t_end:g} s"
        numbers = f"the energy error is {first.without.energy:.2g} without it and {first.usual.energy:.2g} with alpha = beta = {USUAL:g}/s"
        over = f"over the stable part of the map it goes from {first.least.energy:.2g} to {first.most.energy:.2g}"
        velocities = f"|G v| is {first.without.Gv:.2g} without it and {first.usual.Gv:.2g} with it, where its forces do work"
        return f"{exact} {of}, {numbers}; {over}. {velocities[0].upper()}{velocities[1:]}."

    @property
    def table(self) -> "pd.DataFrame":
        """All runs, one row each."""
        return frame(
            [*(one for cells in (*self.maps.values(), self.penalty, *self.tolerant.values()) for one in cells), *self.beside], self.h
        )

    def summary(self) -> dict[str, Any]:
        """Return effects, limits and the best of each map, for JSON."""
        about = {
            "problem": self.ivp.problem,
            "case": self.ivp.case,
            "parameters": dict(self.ivp.parameters),
            "h": self.h,
            "t_end": self.t_end,
        }
        limits = [{key: None if value == float("inf") else value for key, value in vars(one).items()} for one in self.limits]
        return about | {
            "answer": self.answer,
            "effects": [_effect(one) for one in self.effects],
            "limits": limits,
            "beside": [_cell(one) for one in self.beside],
            "tolerances": {
                f"{tol:g}": {"least": _cell(_least(cells)), "cheapest": _cell(_cheapest(cells))} for tol, cells in self.tolerant.items()
            },
            "penalty": _cell(_least(self.penalty)),
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield the answer, the effects with methods beside them, and the limits of stability."""
        yield self.answer
        rows = []
        for effect in self.effects:
            rows += [
                _row(effect.scheme, "none", effect.without, effect.drift_without.verdict),
                _row("", _options(effect.usual), effect.usual, effect.drift_usual.verdict),
                _row("", _options(effect.least), effect.least, "least energy error"),
                _row("", _options(effect.most), effect.most, "most, where stable"),
            ]
        rows += [_row(one.method, "", one, "") for one in self.beside]
        yield Table(["method", "alpha, beta 1/s", "energy error", "|g|", "|G v|", "work", "energy"], rows)
        limits = [[one.scheme, f"{one.ratio:g}", _bounded(one.predicted), _bounded(one.measured), one.by or "none"] for one in self.limits]
        yield Table(["method", "beta / alpha", "limit of alpha h, predicted", "measured", "by"], limits)


def _options(one: Cell) -> str:
    return ", ".join(f"{x:.3g}" for x in one.options.values())


def _bounded(x: float) -> str:
    return "none" if x == float("inf") else f"{x:.4g}"


def _row(method: str, options: str, one: Cell, note: str) -> list[str]:
    return [method, options, *(f"{x:.2g}" for x in (one.energy, one.g, one.Gv)), str(one.work), note]


def _cell(one: Cell) -> dict[str, Any]:
    numbers = {"energy_error": one.energy, "g": one.g, "Gv": one.Gv}
    finite = {key: value if np.isfinite(value) else None for key, value in numbers.items()}
    about = {"method": one.method, "value": one.value, "options": dict(one.options)}
    return about | finite | {"evaluations": one.work, "failure": one.failure}


def _effect(one: Effect) -> dict[str, Any]:
    cells = {name: _cell(getattr(one, name)) for name in ("without", "usual", "least", "most")}
    drifts = {"verdict_without": one.drift_without.verdict, "verdict_usual": one.drift_usual.verdict}
    return {"scheme": one.scheme, "ratio": one.ratio if np.isfinite(one.ratio) else None} | cells | drifts


def _least(cells: Sequence[Cell]) -> Cell:
    return min(cells, key=lambda one: one.energy)


def _cheapest(cells: Sequence[Cell]) -> Cell:
    return min((one for one in cells if not one.failure), key=lambda one: one.work, default=cells[0])


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

    Returns
    -------
    BaumgarteMap

    Raises
    ------
    BadInput
        If no method is a scheme that can be stabilised, a number is invalid, or the problem is a Poisson system, has arrays as vectors, or
        has constraints that depend on others at the start, unless ``on_singular`` is "least-squares".
    """
    ivp = _problem(problem, case, parameters, on_singular)
    for name, numbers in (("tolerances", tolerances), ("values", values), ("rates", rates)):
        for x in numbers:
            positive(name, x)
    fit = takes_form("baumgarte")
    mapped = [name for name in methods if name in fit]
    if not mapped:
        raise BadInput(f"none of {', '.join(methods) or 'no methods'} can be stabilised; give at least one of {', '.join(fit)}.")
    h = default_step(ivp) if h is None else positive("h", h)
    t_end = positive("t_end", t_end)
    others = [name for name in methods if name not in mapped]
    for name in others:
        if method_of(ivp, name).knob != "h":
            raise BadInput(f"{name} chooses its own steps; give fixed-step methods, for example rattle.")
    tell = _Counted(progress, (len(mapped) + 1) * len(values) ** 2 + len(values) + len(tolerances) * len(rates) ** 2)
    maps = {f"baumgarte:{scheme}": over_step(ivp, "baumgarte", scheme, h, t_end, values, tell) for scheme in mapped}
    maps[f"soft:{mapped[0]}"] = over_step(ivp, "soft", mapped[0], h, t_end, values, tell)
    return BaumgarteMap(
        ivp,
        h,
        t_end,
        maps,
        penalised(ivp, mapped[0], h, t_end, values, tell),
        {tol: over_tolerance(ivp, tol, t_end, rates, tell) for tol in tolerances},
        [_effect_of(ivp, scheme, h, t_end, maps[f"baumgarte:{scheme}"], values) for scheme in mapped],
        [_limit(ivp, scheme, h, ratio) for scheme in mapped for ratio in RATIOS],
        [cell(ivp, name, h, t_end, {}) for name in others],
    )


def _problem(problem: Any, case: str | None, parameters: Mapping[str, float] | None, on_singular: str | None) -> ConstrainedIvp:
    """Return the problem; refuse one whose constraints cannot be stabilised."""
    ivp = constrained(initial_value_problem(problem, case, parameters, on_singular=on_singular), "which has no constraints to stabilise")
    if ivp.arrays:
        raise BadInput(f"{ivp.problem}, case {ivp.case}, is held as arrays; choose another problem or case.")
    if not ivp.singular and (why := dependence(ivp)):
        raise BadInput(f"{ivp.problem}, case {ivp.case}, cannot be stabilised: G M^-1 G^T is singular at the start, where {why}.")
    return ivp


class _Counted:
    """Tells how far it is."""

    def __init__(self, progress: Progress | None, of: int) -> None:
        self.progress, self.of, self.done = progress, of, 0

    def __call__(self) -> None:
        self.done += 1
        if self.progress:
            self.progress(self.done / self.of)


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
    return Effect(scheme, without, at_usual, drifts[0], drifts[1], _least(among), max(among, key=lambda one: one.energy))


def _limit(ivp: ConstrainedIvp, scheme: str, h: float, ratio: float) -> Limit:
    predicted = limit(scheme, ratio)
    here = np.array(predicted * 1.01), np.array(ratio * predicted * 1.01)
    by = "" if predicted == float("inf") else "growth" if contraction(scheme, *here) < SLOWEST else "iteration"
    return Limit(scheme, ratio, predicted, measured_limit(ivp, scheme, h, ratio), by)
