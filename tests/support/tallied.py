"""The work of a run counted independently: by wrapping the functions of its uncompiled kernel."""

from daebench.compiler.work import WORK
from daebench.runs.trajectory import CONSTRAINED

KINDS = {name: name for name in ("H_p", "H_q", "g", "G")} | {"K_y": "H_q", "L_q": "H_q", "L_qv": "second", "two_form": "second"}
KINDS |= dict.fromkeys(("H_pp", "H_qq", "H_qp", "Gv_p", "Gv_q", "curvature", "a_p"), "second")
KINDS |= dict.fromkeys(("solve", "solve_d", "solve_dm", "solve_dd", "solve_2m", "solve_2d"), "solve")
KINDS |= dict.fromkeys(("solve_mass", "solve_mass_m", "solve_mass_d"), "solve")
KINDS |= dict.fromkeys(("solve_stages", "solve_stages_but_one", "solve_stages_twice", "solve_stages_twice_d"), "solve")


def tally(monkeypatch, method, ivp, request):
    """Return the work of a run by kind, counted call by call."""
    kernel, found = method.kernel(ivp, "float64", request.watched(CONSTRAINED), count=True), dict.fromkeys(WORK, 0)
    sweeps = [each for each in vars(kernel) if "update" in each and not each.startswith(("newton", "relax", "tally", "branch_walked"))]
    for function, kind in (KINDS | dict.fromkeys(sweeps, "newton")).items():
        if hasattr(kernel, function):
            monkeypatch.setattr(kernel, function, _counting(getattr(kernel, function), found, kind))
    for name in ("rows", "independence", "chart"):
        if hasattr(kernel, name):
            monkeypatch.setattr(kernel, name, _not_counting(getattr(kernel, name), found))
    method.solve(ivp, request)
    return found


def _counting(function, found, kind):
    def wrapper(*arguments):
        found[kind] += 1
        return function(*arguments)

    return wrapper


def _not_counting(function, found):
    """M^-1 on rows of G is algebra, whatever it is composed of, and a map to the coordinates of the output is no step."""

    def wrapper(*arguments):
        before = dict(found)
        result = function(*arguments)
        found.update(before)
        return result

    return wrapper
