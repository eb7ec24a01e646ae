"""The work of a run counted independently: by wrapping the functions of its kernel, which Python executes as they are written."""

import uncompiled

from daebench.compiler.facts import WORK
from daebench.compiler.files import Function

KINDS = {name: name for name in ("H_p", "H_q", "g", "G")} | {"K_y": "H_q", "L_q": "H_q", "L_qv": "second", "two_form": "second"}
KINDS |= dict.fromkeys(("H_pp", "H_qq", "H_qp", "Gv_p", "Gv_q", "A_qv", "curvature", "a_p"), "second")
KINDS |= dict.fromkeys(("solve", "solve_d", "solve_dm", "solve_dd", "solve_2m", "solve_2d"), "solve")
KINDS |= dict.fromkeys(("solve_mass", "solve_mass_m", "solve_mass_d"), "solve")
KINDS |= dict.fromkeys(("solve_stages", "solve_stages_but_one", "solve_stages_twice", "solve_stages_twice_d"), "solve")


def tally(monkeypatch, method, ivp, request):
    """Return the work of a run by kind, counted call by call."""
    monkeypatch.setattr(type(method), "kernel", uncompiled.kernel)
    kernel, found = method.kernel(ivp, "float64", request.watched(ivp.state), count=True), dict.fromkeys(WORK, 0)
    method.solve(ivp, request)  # reads the files, and makes the operations that are called
    wrapped = {}
    for space in [vars(kernel), *kernel.FILES.read.values()]:
        for name, function in list(space.items()):
            of_file = isinstance(function, Function)
            kind = "newton" if of_file and "update" in name else KINDS.get(name)
            if id(function) not in wrapped and callable(function) and (of_file or space is vars(kernel)):
                if kind:
                    wrapped[id(function)] = _counting(function, found, kind)
                elif name in ("rows", "independence", "chart"):
                    wrapped[id(function)] = _not_counting(function, found)
            if id(function) in wrapped:
                monkeypatch.setitem(space, name, wrapped[id(function)])
    method.solve(ivp, request)
    return found


def _counting(function, found, kind):
    def wrapper(*arguments):
        found[kind] += 1
        return function(*arguments)

    wrapper.key = getattr(function, "key", "")
    return wrapper


def _not_counting(function, found):
    """M^-1 on rows of G is algebra, whatever it is composed of, and a map to the coordinates of the output is no step."""

    def wrapper(*arguments):
        before = dict(found)
        result = function(*arguments)
        found.update(before)
        return result

    return wrapper
