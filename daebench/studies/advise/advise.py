"""``daebench.advise``: the method for an accuracy, its step size or tolerance, and its cost."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from daebench.compiler.cache import cache_directory
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.records.store import opened
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Told
from daebench.runs.state import CONSTRAINED, POISSON
from daebench.runs.texts import number, words
from daebench.studies.advise.advice import Advice
from daebench.studies.advise.choice import Work, chosen_of, reference_of, searched, why_nothing
from daebench.studies.advise.evidence import changes
from daebench.studies.advise.question import SHARE, STARTS, Question
from daebench.studies.grid.claimed import claimed, feasible, usual
from daebench.studies.measurable import claimed_order

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

ON_MANIFOLD = (
    *("rattle", "symplectic_euler", "rattle/suzuki4", "rattle/kahan_li8", "lobatto3", "lobatto4", "lobatto3/kahan_li8"),
    *("strang", "strang/suzuki4", "rk4", "rk4+proj", "local:rk4", "local:gauss3", "local:gauss4"),
    *("radau3_ggl", "generalized_alpha", "rattle_conformal"),
    *("heyoka:taylor", "cvode:adams", "ida:index1", "ida:index2", "ida:ggl", "ida:ode", "scipy:DOP853", "solve_dae:Radau"),
)
"""Methods for constrained problems: one to three of each family."""

ON_POISSON = (
    *("symplectic_euler", "strang", "strang/suzuki4", "strang/kahan_li8", "midpoint", "midpoint/suzuki4", "midpoint/kahan_li8", "rk4"),
    *("heyoka:taylor", "cvode:adams", "ida:ode", "scipy:DOP853"),
)
"""Methods for Poisson systems."""

METHODS = {CONSTRAINED: ON_MANIFOLD, POISSON: ON_POISSON}

SHARP = 1e-4
"""Accuracy from which on methods of high order are tried first."""

FIRST = ("heyoka:taylor", "local:rk4", "rk4")
"""Methods that are tried before all others. They are often the cheapest, and what they take bounds how far others are followed."""

OF_SOLVERS = {"cvode:adams": 7, "scipy:DOP853": 6}
"""Where solvers that choose their steps stand among orders; others stand with order 3."""

UNITS = {"us": 1e-6, "ms": 1e-3, "s": 1.0}
"""Units of a time, s, by the ending of its text; a longer ending comes first."""


def seconds_in(text: str) -> float:
    """Return the time in a text such as 20ms, or of a number of seconds, s."""
    ending = next((ending for ending in UNITS if text.endswith(ending)), "")
    return UNITS.get(ending, 1.0) * number("--budget", text.removesuffix(ending))


def things_in(text: str) -> list[str]:
    """Return the conserved quantities in a text, whose names may be written with hyphens."""
    return [name.replace("-", "_") for name in words(text)]


def advise(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    accuracy: float,
    t_end: float,
    keep: Annotated[Sequence[str], Option("--keep", read=things_in)] = (),
    budget: Annotated[float | None, Option("--budget", read=seconds_in)] = None,
    share: float = SHARE,
    starts: Annotated[int, Option("--ensemble")] = STARTS,
    methods: Sequence[str] | None = None,
    also: Sequence[str] = (),
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    seed: int = 0,
    anyway: bool = False,
    on_singular: str | None = None,
    store: str | Path | None = None,
    progress: Told | None = None,
    **start: Unpack[OwnStart],
) -> Advice:
    """Find the cheapest method for an accuracy, with its step size or tolerance.

    The accuracy holds for a share of starts: some near the start of the case are run as well. The choice conserves a quantity if it claims
    this and a run over ten times the horizon shows it. Each method is run with finer and finer step sizes or tolerances until it reaches
    the accuracy. A method that becomes much more expensive than the cheapest so far is not refined further. The cheapest are then run from
    other starts, with finer steps or tolerances until a share of these starts is within the accuracy. The choice is run over ten times the
    horizon, with twice the step, and with parameters changed by 20 %, one thing at a time. Runs are stored, so a second question takes
    little time::

        >>> import daebench
        >>> advice = daebench.advise("planar_pendulum", accuracy=1e-3, t_end=2.0, methods=["rattle", "lobatto3"])
        >>> advice.choice.error <= 1e-3, advice.kept["two_form"].kept
        (True, True)
        >>> advice.starts.number, advice.starts.within(1e-3).low >= 0.95
        (128, True)

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, or path of a problem file, which is executed.
    accuracy : float
        Largest error of a position at about 32 to 64 equidistant times, in its unit; for a Poisson system of a component of y.
    t_end : float
        Horizon, s.
    keep : sequence of str
        Quantities to be conserved: "energy" without drift, "constraints", "casimirs", "two_form". The method has to claim it, and a run
        over ten times the horizon has to confirm it.
    budget : float, optional
        Largest CPU time of the run, s; on the command line as 1s, 20ms or a number of seconds.
    share : float
        Share of the other starts whose errors are within the accuracy as well: as many are as show this with a confidence of 95 %. With 0
        the accuracy is that from the start of the case only.
    starts : int
        Number of other starts, drawn from a neighbourhood of 1 %. Fewer than 72 cannot confirm a share of 0.95: all have to be within then.
    methods : sequence of str, optional
        Methods to try, in place of one or two of each family; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    also : sequence of str
        Further methods to try, for example your own integrator ``./mine.py:step``.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    seed : int
        Seeds the starts.
    anyway : bool
        Whether a scheme may be run on a Poisson system outside of the class for which it is a Poisson integrator.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    store : path, optional
        File of the stored runs; by default one beside the compiled kernels.
    progress : callable, optional
        Called with the fraction of the work done and a label of the current task; first of all, with the fraction 0, with the plan.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    Advice
        If no run meets the request, its ``choice`` is None, and ``why`` describes the best run.

    Raises
    ------
    BadInput
        If the question cannot be answered: a number is invalid, no method applies to the problem, or the reference is not accurate enough.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    if not isinstance(problem, str):
        raise BadInput(
            "advise stores runs by their names; give the name of a problem, or the path of its file.", "advise-needs-stored-name"
        )
    question = Question(
        problem=problem,
        case=ivp.case,
        accuracy=accuracy,
        t_end=t_end,
        keep=tuple(keep),
        budget=math.inf if budget is None else budget,
        starts=starts,
        share=share,
        parameters=dict(parameters or {}),
        seed=seed,
        anyway=anyway,
        on_singular=on_singular,
    )
    names, left_out = candidates(question, methods, also)
    reference = reference_of(question, names[0])
    with opened(Path(store) if store is not None else cache_directory() / "advise.db") as runs:
        return _answer(Work(question, runs, progress), names, left_out, reference)


def _answer(work: Work, names: Sequence[str], left_out: dict[str, str], reference: tuple[str, float]) -> Advice:
    """Return the answer to a question, of these methods, by their errors against a reference."""
    question = work.question
    results = tuple(searched(work, names, left_out))
    chosen = chosen_of(work, results, left_out)
    advice = Advice(question, results, left_out, *reference, tuple(choice for choice, _ in chosen))
    if not chosen:
        return replace(advice, why=why_nothing(question, results, left_out))
    choice, conserved = chosen[0]
    work.tell_after(0.55, f"{choice.method} from other starts")
    starts = work.from_starts(choice.method, choice.value)
    work.tell_after(0.6, "what breaks first")
    broken = tuple(changes(question, choice.method, choice.knob, choice.value, work.make))
    return replace(advice, kept=conserved, starts=starts, changes=broken)


def candidates(question: Question, methods: Sequence[str] | None, also: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return the methods that are tried, in order, and why others are not."""
    names = list(dict.fromkeys((*(usual(METHODS, question.ivp) if methods is None else methods), *also)))
    for name in (*(methods or ()), *also):
        question.solver(name)
    accepted, left_out = feasible(question.ivp, names, anyway=question.anyway)
    for name in list(accepted):
        if lacking := set(question.keep) - claimed(question.ivp, question.solver(name)):
            accepted.remove(name)
            left_out[name] = f"{name} does not claim to keep {', '.join(sorted(lacking)).replace('_', '-')}"
    if not accepted:
        raise BadInput(
            f"no method is left for {question.problem}: {'; '.join(why.rstrip('.') for why in left_out.values())}.", "no-method-left"
        )
    return sorted(accepted, key=lambda name: _rank(question, name)), left_out


def _rank(question: Question, name: str) -> tuple[float, int]:
    """Return where a method stands: the first three, and then by its order, high orders first where accuracy is high."""
    if name in FIRST:
        return -math.inf, FIRST.index(name)
    solver = question.solver(name)
    order = (claimed_order(solver) or 2) if solver.knob == "h" else OF_SOLVERS.get(name, 3)
    return float(-order if question.accuracy < SHARP else order), 0
