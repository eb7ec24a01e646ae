"""``daebench.advise``: the method for an accuracy, its step size or tolerance, and its cost."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.compiler.cache import cache_directory
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.records.store import opened
from daebench.studies.advise.advice import Advice
from daebench.studies.advise.candidates import candidates
from daebench.studies.advise.choice import Progress, Work, chosen_of, reference_of, searched, why_nothing
from daebench.studies.advise.question import SHARE, STARTS, Question
from daebench.studies.advise.sensitivity import OverStarts, changes

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


def advise(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    accuracy: float,
    t_end: float,
    keep: Sequence[str] = (),
    budget: float | None = None,
    share: float = SHARE,
    starts: int = STARTS,
    methods: Sequence[str] | None = None,
    also: Sequence[str] = (),
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    seed: int = 0,
    anyway: bool = False,
    on_singular: str | None = None,
    store: str | Path | None = None,
    progress: Progress | None = None,
) -> Advice:
    """Return the cheapest method for an accuracy: step size or tolerance, cost, conserved quantities, and failures under changes.

    Each method is run with finer and finer step sizes or tolerances until it reaches the accuracy. A method that becomes much more
    expensive than the cheapest so far is not refined further. The cheapest are then run from other starts, with finer steps or tolerances
    until a share of these starts is within the accuracy. The choice is run over ten times the horizon, with twice the step, and with
    parameters changed by 20 %, one thing at a time. Runs are stored, so that a second question about the same problem takes little
    time::

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
        Largest CPU time of the run, s.
    share : float
        Share of the other starts whose errors are within the accuracy as well: as many are as show this with a confidence of 95 %. With 0
        the accuracy is that from the start of the case only.
    starts : int
        Number of other starts, drawn from a neighbourhood of 1 %. Fewer than 72 cannot confirm a share of 0.95: all have to be within then.
    methods : sequence of str, optional
        Methods to try, in place of one or two of each family.
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

    Returns
    -------
    Advice
        If no run meets the request, its ``choice`` is None, and ``why`` describes the best run.

    Raises
    ------
    BadInput
        If the question cannot be answered: a number is invalid, no method applies to the problem, or the reference is not accurate enough.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular)
    numbers: dict[str, Any] = {"accuracy": accuracy, "t_end": t_end, "starts": starts, "share": share, "seed": seed}
    numbers |= {"parameters": dict(parameters or {}), "budget": math.inf if budget is None else budget, "keep": tuple(keep)}
    numbers |= {"anyway": anyway, "on_singular": on_singular}
    if not isinstance(problem, str):
        raise BadInput("advise stores runs by their names; give the name of a problem, or the path of its file.")
    question = Question(problem=problem, case=ivp.case, **numbers)
    names, left_out = candidates(question, methods, also)
    words, bound = reference_of(question, names[0])
    path = Path(store) if store is not None else cache_directory() / "advise.db"
    with opened(path) as kept_runs:
        work = Work(question, kept_runs, progress)
        results = searched(work, names, left_out)
        chosen = chosen_of(work, results, left_out)
        common: dict[str, Any] = {"question": question, "found": tuple(results), "left_out": left_out, "reference": words, "bound": bound}
        if not chosen:
            nothing: dict[str, Any] = {"choice": None, "runners_up": (), "kept": {}, "starts": OverStarts(), "changes": ()}
            return Advice(**common, **nothing, why=why_nothing(question, results, left_out))
        (choice, conserved), *others = chosen
        work.tell_after(0.55, f"{choice.method} from other starts")
        from_starts = work.from_starts(choice.method, choice.value)
        work.tell_after(0.6, "what breaks first")
        broken = changes(question, choice.method, choice.knob, choice.value, work.make)
        best: dict[str, Any] = {"choice": choice, "runners_up": tuple(other for other, _ in others), "kept": conserved}
        return Advice(**common, **best, starts=from_starts, changes=tuple(broken))
