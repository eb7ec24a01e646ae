"""A problem with the numbers of a case: its parameters and initial values, or those given in their place."""

import types
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from daebench.errors import BadInput, real, unknown
from daebench.scene import Array, PoissonScene, Scene, Setting
from daebench.source import Source


def make_scene(
    source: Source,
    case: str,
    parameters: Mapping[str, float] | None = None,
    *,
    p0: Sequence[float] | None = None,
    q0: Sequence[float] | None = None,
) -> Scene:
    """Return the scene of a case of a constrained problem, with parameters and initial values replaced where they are given.

    Raises
    ------
    BadInput
        If the case or a parameter is unknown, a value is not a finite number, or the problem is a Poisson system.
    """
    return constrained(make_setting(source, case, parameters, p0=p0, q0=q0))


def constrained(setting: Setting) -> Scene:
    """Return a setting as that of a constrained problem; raise :class:`BadInput` where it is a Poisson system's."""
    if not isinstance(setting, Scene):
        raise BadInput(f"{setting.problem} is a Poisson system, and this is for constrained problems; daebench list problems has them.")
    return setting


def make_setting(
    source: Source,
    case: str,
    parameters: Mapping[str, float] | None = None,
    **given: Sequence[float] | None,
) -> Scene | PoissonScene:
    """Return a problem with the numbers of a case: parameters and initial values (p0 and q0, or y0) replaced where they are given.

    Raises
    ------
    BadInput
        If the case or a parameter is unknown, a value is not a finite number, or initial values are those of another kind of problem.
    """
    sheet = source.sheet
    names = ("y0",) if sheet.KIND == "poisson" else ("p0", "q0")
    for name, values in given.items():
        if values is not None and name not in names:
            raise BadInput(f"{source.problem} starts from {' and '.join(names)}; leave out {name}.")
    free = not sheet.CASES and all(given.get(name) is not None for name in names)
    if case not in sheet.CASES and not free:
        raise unknown(f"case of {source.problem}", case, sheet.CASES)
    found = _parameters(source, {} if free else sheet.CASES[case]["parameters"], parameters or {})
    own = () if free else _case_start(sheet, case, found)
    start = [own[k] if (values := given.get(name)) is None else initial_values(name, values, sheet) for k, name in enumerate(names)]
    for name, array in zip(names, start, strict=True):
        if not np.all(np.isfinite(array)):
            raise BadInput(f"{name} of {source.problem}, case {case}, is {array.tolist()}; it must be finite numbers.")
    if sheet.KIND == "poisson":
        return _in_domain(PoissonScene(source, case, found, *start))
    return Scene(source, case, found, start[0], start[1], on_singular=sheet.CASES.get(case, {}).get("on_singular", "stop"))


def _parameters(source: Source, of_case: Mapping[str, float], given: Mapping[str, float]) -> dict[str, float]:
    """Return the values of all parameters: the defaults, those of the case, and those that are given, each over the one before."""
    found: dict[str, float] = dict(source.defaults or source.sheet.PARAMETERS)
    found |= {name: float(value) for name, value in of_case.items() if name in found}
    for name, value in given.items():
        if name not in found:
            raise unknown(f"parameter of {source.problem}", name, found)
        found[name] = real(name, value)
    _require_positive(source.problem, source.sheet, found)
    return found


def _in_domain(scene: PoissonScene) -> PoissonScene:
    domain = " and ".join(f"{each} > 0" for each in scene.sheet.DOMAIN)
    if domain and not bool(scene.value("inside", scene.y0)):
        raise BadInput(f"y0 = {scene.y0.tolist()} of {scene.problem} is outside of its domain {domain}; start inside.")
    return scene


def _require_positive(problem: str, sheet: types.ModuleType, values: Mapping[str, float]) -> None:
    for name in sheet.POSITIVE:
        if not values[name] > 0:
            raise BadInput(f"{name} = {values[name]:g} of {problem} must be greater than 0.")


def _case_start(sheet: types.ModuleType, case: str, values: Mapping[str, float]) -> tuple[Array, ...]:
    with np.errstate(all="ignore"):
        start = sheet.INITIAL[case](tuple(map(np.float64, values.values())))
    return tuple(np.array(x, dtype=float) for x in (start if np.ndim(start) > 1 else (start,)))


def initial_values(name: str, values: Any, sheet: types.ModuleType) -> Array:
    """Return initial values as an array, shape(d,), each a finite number.

    Raises
    ------
    BadInput
        If they are not as many as the problem has positions or coordinates, or one is no finite number.
    """
    d, what = (sheet.N, "coordinates") if sheet.KIND == "poisson" else (sheet.D, "positions")
    if isinstance(values, str) or not np.iterable(values):
        raise BadInput(f"{name} = {values!r} must be {d} numbers.")
    numbers = list(values)
    if len(numbers) != d:
        raise BadInput(f"{name} has {len(numbers)} numbers; the problem has {d} {what}.")
    return np.array([real(f"{name}[{i}]", value) for i, value in enumerate(numbers)])
