"""All extremes of a problem, one after the other."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from daebench.errors import BadInput, require_known, unknown
from daebench.methods.outside.read import is_outside
from daebench.runs.ivp import Ivp
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart
from daebench.runs.result import Result
from daebench.runs.texts import numbers
from daebench.studies.grid.runs import Runs, unstored
from daebench.studies.stability import lost_motion, outcome_map, parameter_range, penalty, round_off, step_limit
from daebench.studies.stability.extreme import Asked, asked_of

if TYPE_CHECKING:
    import pandas as pd

ABOUT = {
    step_limit: "the largest usable step of each method, by bisection",
    outcome_map: "outcomes of runs over step size and a parameter",
    parameter_range: "mass ratios from 1e-8 to 1e8, or another parameter over given values",
    penalty: "a stiff penalty in place of the constraint, as eps goes to 0",
    round_off: "step sizes and tolerances to 0, until round-off wins or a solver gives up",
    lost_motion: "the time for which a motion that amplifies errors is followed: chaos, starts near unstable equilibria",
}
"""The module of each extreme, and what it does in one line."""

EXTREMES = {module.__name__.rpartition(".")[2].replace("_", "-"): module for module in ABOUT}
"""The extremes, by name."""


def chosen(asked: Asked, only: Sequence[str] = ()) -> tuple[list[str], dict[str, str]]:
    """Return the names of the extremes that a problem has, and why it has not the others, or methods; BadInput if a name is unknown."""
    if only:
        require_known(*(("extreme", name, EXTREMES) for name in only))
    refused = {name: why for name in only or EXTREMES if (why := EXTREMES[name].refusal(asked))}
    absent = {name: why.removesuffix(".") for name, why in asked.left_out.items()}
    return [name for name in only or EXTREMES if name not in refused], refused | absent


@dataclass(frozen=True)
class Stability(Result):
    """The limits of methods."""

    ivp: Ivp
    """The problem."""
    tables: Mapping[str, "pd.DataFrame"]
    """The runs of each extreme, by its name."""
    left_out: Mapping[str, str]
    """Why extremes, and methods, are left out."""

    @classmethod
    def outputs(cls, only: Sequence[str] | None = None, **asked: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return no tables, and the extremes, each of which has a picture with its table."""
        return (), tuple(only or EXTREMES)

    @property
    def said(self) -> dict[str, list[str]]:
        """The findings of each extreme, in sentences."""
        return {name: EXTREMES[name].says(table) for name, table in self.tables.items()}

    @property
    def status(self) -> int:
        """1 if code from outside has no step with which it completes a run, or keeps the energy."""
        table = self.tables.get("step-limit")
        limits = {} if table is None else dict(table.groupby("method")["h"].max())
        return int(any(is_outside(str(method)) and not h > 0 for method, h in limits.items()))

    def summary(self) -> dict[str, Any]:
        """Return the sentences, for JSON."""
        return {"said": self.said, "left_out": self.left_out}

    def printed(self) -> Iterator[str]:
        """Yield the sentences on each extreme, and why others are left out."""
        yield from ("\n  ".join((f"{name}: {ABOUT[EXTREMES[name]]}", *said)) for name, said in self.said.items())
        yield from (f"no {name}: {why}." for name, why in self.left_out.items())

    def write(self, folder: Path) -> list[Path]:
        """Write the picture of each extreme with its table; return the paths of the pictures."""
        return [EXTREMES[name].draw(folder, name, table) for name, table in self.tables.items()]

    def _picture(self) -> str:
        """Return no picture for a notebook: there are several, which are written."""
        return ""


def _varied(text: str) -> dict[str, list[float]]:
    """Return the parameter of a text name=value,value,..., and its values."""
    name, equals, values = text.partition("=")
    if not equals:
        raise BadInput(f"--param {text!r} must be of the form name=value,value,...", "varied-values-malformed")
    return {name.strip(): numbers(f"--param {name.strip()}", values) or []}


def stability(
    problem: str,
    *,
    case: str | None = None,
    methods: Sequence[str] | None = None,
    only: Sequence[str] | None = None,
    h: Sequence[float] | None = None,
    varied: Annotated[Mapping[str, Sequence[float]] | None, Option("--param", read=_varied)] = None,
    near: float = 0.0,
    t_end: float | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    runs: Runs = unstored,
    **start: Unpack[OwnStart],
) -> Stability:
    """Find where methods break: steps too large and too small, masses, penalties, chaos.

    The extremes are: the largest usable step by bisection (step-limit), which makes some twenty runs for each method and criterion that a
    dry run does not count; a map of the outcomes of runs over step size and a parameter (outcome-map); mass ratios from 1e-8 to 1e8 or any
    parameter (parameter-range); a penalty in place of the constraint (penalty); steps and tolerances to 0 (round-off); the time for which a
    method follows a motion that amplifies errors (lost-motion).

    Parameters
    ----------
    problem : str
        Name in the catalogue, or the path of a problem file, which is executed.
    case : str, optional
        Named initial values; by default the problem's first.
    methods : sequence of str, optional
        Names of methods; by default some of each family; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    only : sequence of str, optional
        Some of step-limit, outcome-map, parameter-range, penalty, round-off, lost-motion; by default all that apply.
    h : sequence of float, optional
        Step sizes, s; by default chosen by each extreme.
    varied : mapping of str to sequence of float, optional
        The parameter to vary and its values, name=value,value,...; chosen if left out.
    near : float
        Limit of the parameter; pictures show the distance from it.
    t_end : float, optional
        End of all runs, s; 10 or the end of the reference if left out.
    anyway : bool
        Whether schemes may run on Poisson systems for which they are not Poisson integrators.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    runs : callable
        Makes the rows of runs; ``daebench.studies.grid.runs.runs_of`` has them in a store.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    Stability

    Raises
    ------
    BadInput
        If a name or number is invalid.

    Examples
    --------
    >>> import daebench
    >>> limits = daebench.stability("planar_pendulum", methods=["rattle"], only=["step-limit"], t_end=2)
    >>> list(limits.tables["step-limit"]["verdict"])
    ['completes', 'keeps the energy']
    """
    more: dict[str, Any] = {"anyway": anyway, "on_singular": on_singular, "parameters": varied or {}, "near": near}
    asked = asked_of(problem, case, methods, h, t_end, start=start, **more)
    for name in asked.parameters:
        if name not in asked.ivp.parameters:
            raise unknown(f"parameter of {problem}", name, asked.ivp.parameters)
    names, left_out = chosen(asked, only or ())
    if runs is not unstored:  # side by side
        runs([run for name in names for run in EXTREMES[name].specifications(asked)])
    return Stability(asked.ivp, {name: EXTREMES[name].measure(asked, runs) for name in names}, left_out)
