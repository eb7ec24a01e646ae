"""``daebench.load``: a trajectory from its file."""

from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput, DaebenchError
from daebench.methods.foreign import ForeignName
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.json_values import strict
from daebench.runs.own_start import base
from daebench.runs.schema import Fields, Flag, Items, Named, Number, Text, Whole, maybe
from daebench.runs.state import POISSON, state_of_columns
from daebench.runs.trajectory import IN_FILES, Array, Passage, PoissonTrajectory, Trajectory
from daebench.runs.trajectory_files import ABOUT
from daebench.runs.zipped import UNREADABLE, arrays_in

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


REAL = maybe(Number(), "a finite number")
KIND = Fields(
    {
        **{name: Text(4096) for name in ("problem", "case", "method", "knob", "maxima_over")},
        "parameters": Named(Number()),
        "value": REAL,
        "steps": Whole(),
        "work": Named(REAL),
        "maxima": Named(REAL),
        **dict.fromkeys(("pivot", "seconds", "compile_seconds", "callback_seconds"), REAL),
        "failure": maybe(Text(100_000), "a text"),
        "interrupted": Flag(),
    },
    {
        "definition": Text(),
        "passages": Items(Fields({"t": REAL, "pivot": REAL, "branch": Text(), "turn": REAL}), most=10**6),
    },
    open=True,
)
"""What the text in a file says."""


def load(
    path: "str | Path", problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem | None" = None
) -> Trajectory | PoissonTrajectory:
    """Return the trajectory of a file that :meth:`daebench.Trajectory.save` or ``daebench run --out FILE.npz`` wrote.

    Nothing in the file is executed. Its problem comes from the catalogue if that has a problem of this name with the same equations;
    otherwise pictures and energies need the argument ``problem``::

        >>> import daebench
        >>> import tempfile, pathlib
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "swing.npz"
        >>> swing = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=0.01, t_end=1)
        >>> len(swing.save(file)), bool((daebench.load(file).q == swing.q).all())
        (1, True)

    Parameters
    ----------
    path : str or Path
        The file, FILE.npz.
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem, optional
        Problem that was solved: a name, the path of a problem file, which is executed, or a definition.

    Returns
    -------
    Trajectory or PoissonTrajectory

    Raises
    ------
    BadInput
        If there is no such file, if it is damaged or not a trajectory, or if the problem has other equations than the file.
    """
    path = Path(path)
    arrays = _arrays(path)
    try:
        about = KIND.read(strict(str(arrays.pop(ABOUT))), "its text")
        state = state_of_columns(arrays)
        given = {name: about[name] for name in IN_FILES}
        # JSON has no NaN: a largest error that was not finite has been written as null.
        given["maxima"] = {name: nan if value is None else value for name, value in given["maxima"].items()}
        states: dict[str, Any] = {name: _checked(name, arrays[name], arrays["t"]) for name in ("t", *state.columns)}
        raw = _stage_multipliers(arrays)
        sensitivities = _sensitivities(arrays, state.columns)
    except (KeyError, ValueError, TypeError) as error:
        raise BadInput(
            f"{path} is not a trajectory of daebench, or is damaged ({error}); run it again with --out.", "trajectory-file-damaged"
        ) from error
    ivp = _problem(path, about, problem)
    if ivp is not None and [len(states[name][0]) for name in state.vectors] == [*map(len, ivp.start)]:
        ivp = ivp.at(*(states[name][0] for name in state.vectors))  # the start of the run, which may be another than that of the case
    if state is POISSON:
        return PoissonTrajectory(**given, **states, sensitivities=sensitivities, ivp=ivp)
    passages = tuple(Passage(**passage) for passage in about.get("passages", ()))
    more: dict[str, Any] = {"raw": raw, "lam": arrays.get("lam"), "passages": passages}
    return Trajectory(**given, **states, **more, sensitivities=sensitivities, ivp=ivp)


def _arrays(path: Path) -> dict[str, Any]:
    """Return the arrays of an NPZ file; nothing is unpickled."""
    if not path.is_file():
        raise BadInput(
            f"there is no file {path}; give a file that run.save or daebench run --out FILE.npz wrote.", "no-such-trajectory-file"
        )
    try:
        return dict(arrays_in(path, str(path), small=2**29))
    except UNREADABLE as error:
        raise BadInput(
            f"{path} is not an NPZ file, or is damaged ({error}); daebench.load reads files that run.save wrote.", "not-an-npz-file"
        ) from error


def _checked(name: str, rows: Array, t: Array) -> Array:
    """Return states of a file if there is a row of numbers for each time."""
    if rows.dtype.kind != "f" or rows.ndim != (1 if name == "t" else 2) or not len(t) or len(rows) != len(t):
        raise ValueError(f"{name} has {rows.dtype} of shape {rows.shape}")
    return rows


def _problem(path: Path, about: dict[str, Any], problem: Any) -> Any:
    """Return the initial value problem of a file; None where none is given and the catalogue has none with its equations."""
    if problem is None and not ForeignName(about["problem"], is_method=False).is_own:
        return None
    try:
        # Nothing is solved here, so that a start off the manifold is no reason to refuse a file.
        ivp = initial_value_problem(problem or about["problem"], base(about["case"]) or None, about["parameters"], consistent=False)
    except DaebenchError:
        if problem is None:
            return None
        raise
    if about.get("definition") == ivp.facts.FINGERPRINT:
        return ivp
    if problem is None:
        return None
    raise BadInput(
        f"{path}: the run has other equations or cases than {ivp.problem} has now; give the definition that it was made with.",
        "run-of-other-definition",
    )


def _stage_multipliers(arrays: dict[str, Any]) -> dict[str, tuple[Array, Array]]:
    """Return stage multipliers of a file by name: their times, and their values."""
    names = [name.removeprefix("raw_") for name in arrays if name.startswith("raw_") and f"{name}_t" in arrays]
    return {name: (arrays[f"raw_{name}_t"], arrays[f"raw_{name}"]) for name in names}


def _sensitivities(arrays: dict[str, Any], parts: tuple[str, ...]) -> dict[str, dict[str, Array]]:
    """Return the derivatives of states of a file, by the name of a number and of the states."""
    prefix = f"d{parts[0]}_d"
    names = [name.removeprefix(prefix) for name in arrays if name.startswith(prefix)]
    return {name: {part: arrays[f"d{part}_d{name}"] for part in parts} for name in names}
