"""The same things from Python as from the command line: run and compare."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from daebench.catalogue import find_scene
from daebench.errors import BadInput, unknown
from daebench.inputs import positive, real, whole
from daebench.method import Method, Progress, Request
from daebench.names import parse
from daebench.scene import Scene
from daebench.trajectory import WATCH, Trajectory

if TYPE_CHECKING:
    import pandas as pd

    from daebench.problem import ConstrainedHamiltonian


def scene_of(
    problem: "str | ConstrainedHamiltonian",
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    p0: Sequence[float] | None = None,
    q0: Sequence[float] | None = None,
    project: bool = False,
) -> Scene:
    """Return a problem, by name or as a definition, with the numbers of a case; consistent, or else an error.

    Raises
    ------
    BadInput
        If a name or value is not what it must be.
    InconsistentStart
        If the initial values are off the manifold and are not to be projected.
    """
    from daebench.diagnostics.consistency import projected, require_consistent

    if isinstance(problem, str):
        scene = find_scene(problem, case, parameters, p0=p0, q0=q0)
    elif not hasattr(problem, "fingerprint"):
        raise BadInput(f"a problem is a name or a ConstrainedHamiltonian, not {problem!r}.")
    else:
        from daebench.scene import make_scene, source_of

        name = case if case is not None else next(iter(problem.cases), "")
        scene = make_scene(source_of(problem), name, parameters, p0=p0, q0=q0)
    if project:
        return projected(scene)[0]
    require_consistent(scene)
    return scene


def run(problem: "str | ConstrainedHamiltonian", *, method: str, **settings: Any) -> Trajectory:
    """Return the trajectory of one method on one problem.

    Takes what :func:`prepare` takes, and raises what it raises. A run that stops early is no error: see :attr:`Trajectory.failure`.
    """
    chosen, scene, request = prepare(problem, method=method, **settings)
    return chosen.solve(scene, request)


def prepare(
    problem: "str | ConstrainedHamiltonian",
    *,
    case: str | None = None,
    method: str,
    h: float | None = None,
    tol: float | None = None,
    steps: int | None = None,
    t_end: float | None = None,
    points: int | None = None,
    every: int | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    p0: Sequence[float] | None = None,
    q0: Sequence[float] | None = None,
    watch: Sequence[str] = ("energy", "manifold"),
    project: bool = False,
    precision: str = "float64",
    multipliers: bool = False,
    raw: bool = False,
    compensated: bool = False,
    count: bool = True,
    seconds_limit: float | None = None,
    progress: Progress | None = None,
) -> tuple[Method, Scene, Request]:
    """Return a method, a consistent scene and a request, all checked: what a run needs.

    Parameters
    ----------
    problem : str or ConstrainedHamiltonian
        Name in the catalogue, or a definition.
    case : str, optional
        Named initial values; by default the problem's first.
    method : str
        Name in the grammar of :mod:`daebench.names`, for example "rattle" or "ida:index2".
    h, tol : float
        The method's knob: step size of a fixed-step method, relative and absolute tolerance of the others.
    steps : int, optional
        Number of steps of a fixed-step method.
    t_end : float, optional
        End time, in place of ``steps``.
    points, every : int, optional
        Output: equidistant times of a tolerance-driven method; every so many steps of a fixed-step one, 0 for the end alone.
    parameters, options : mapping of str to float, optional
        Values of the problem's parameters, and free numbers of the method.
    p0, q0 : sequence of float, shape(d,), optional
        Initial values in place of the case's.
    watch : sequence of str
        Any of "energy", "manifold", "integrals".
    project : bool
        Whether initial values are first projected onto the manifold.
    precision : str
        "float64" or "float32".
    multipliers : bool
        Whether lam(p, q) is computed at the output times.
    raw : bool
        Whether the raw multipliers of every step of a fixed-step scheme are kept, see :attr:`Trajectory.raw`.
    compensated : bool
        Whether a fixed-step method compensates its sums over steps for rounding, HLW VIII.5.
    count : bool
        Whether work is counted.
    seconds_limit : float, optional
        Wall-clock limit, s.
    progress : callable, optional
        Told the fraction done.

    Raises
    ------
    BadInput
        If the request cannot be met.
    """
    chosen = parse(method, options, compensated=compensated)
    value = real(chosen.knob, knob_value(chosen, h=h, tol=tol))
    watch = [watch] if isinstance(watch, str) else list(watch)
    for name in watch:
        if name not in WATCH:
            raise unknown("quantity to watch", name, WATCH)
    steps, every, points = (
        None if number is None else whole(name, number) for name, number in (("steps", steps), ("every", every), ("points", points))
    )
    if precision not in ("float64", "float32"):
        raise BadInput(f"unknown precision {precision!r}; it is float64 or float32.")
    scene = scene_of(problem, case, parameters, p0=p0, q0=q0, project=project)
    request = Request(
        value=value,
        t_end=None if t_end is None else real("t_end", t_end),
        steps=steps,
        every=every,
        points=points,
        watch=tuple(watch),
        count=count,
        precision=precision,
        multipliers=multipliers,
        raw=raw,
        progress=progress,
        seconds_limit=None if seconds_limit is None else positive("seconds_limit", seconds_limit),
    )
    chosen.check(scene, request)
    return chosen, scene, request


def knob_value(method: Method, *, h: float | None, tol: float | None) -> float:
    """Return the value of a method's knob.

    Raises
    ------
    BadInput
        If it is missing, or the other one is given.
    """
    own, other = (h, tol) if method.knob == "h" else (tol, h)
    if own is None or other is not None:
        wanted, unwanted = ("a step size h", "a tolerance") if method.knob == "h" else ("a tolerance tol", "a step size")
        raise BadInput(f"{method.name} is steered by {wanted}; {'give one' if own is None else f'leave out {unwanted}'}.")
    return own


def problems() -> "pd.DataFrame":
    """Return all problems, one a row: name, summary, parameters, cases."""
    import pandas as pd

    from daebench import catalogue

    rows = [
        {
            "problem": name,
            "summary": each.summary,
            "parameters": {**each.parameters, **each.structure},
            "cases": list(each.source({}).sheet.CASES),
        }
        for name, each in catalogue.problems().items()
    ]
    return pd.DataFrame(rows)


def methods() -> "pd.DataFrame":
    """Return all methods, one a row: name, knob, system, and for schemes their claims."""
    from dataclasses import asdict

    import pandas as pd

    from daebench.members import members
    from daebench.names import listed

    own = members()
    rows = [asdict(each) | (asdict(own[each.name][1].claims) if each.name in own else {}) for each in listed()]
    return pd.DataFrame(rows).rename(columns={"name": "method"}).convert_dtypes()
