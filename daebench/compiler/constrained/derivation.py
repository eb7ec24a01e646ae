"""Quantities of a problem as functions with arguments and shapes, for the linker and the facts."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from daebench.compiler.constrained.distances import distances, is_water
from daebench.compiler.constrained.quantities import Quantities
from daebench.compiler.derived import Derived, Rules
from daebench.compiler.facts import WORK
from daebench.compiler.linear.algebras import Values
from daebench.compiler.linear.elimination import Target
from daebench.compiler.monitored import Monitored, State, of_constrained
from daebench.systems.constrained import Case

EXPLICIT = {"H": ("p q", ""), "H_p": ("p q", "d"), "H_q": ("p q", "d")} | dict.fromkeys(("H_pp", "H_qp", "H_qq"), ("p q", "dd"))
EXPLICIT |= {"Gv_p": ("p q", "md"), "Gv_q": ("p q", "md"), "a_p": ("p q lam", "md")}
IMPLICIT = {"U": ("q", ""), "U_q": ("q", "d"), "U_qq": ("q", "dd"), "T_q": ("q v", "d"), "g_qv": ("q v", "md")}
IMPLICIT |= dict.fromkeys(("N", "T_qq", "c_v"), ("q v", "dd"))
"""Arguments and shapes of functions that kernels take where H is an expression, and where M and U are."""


class Derivation(Quantities, Derived):
    """The quantities of one problem as functions, with their arguments and shapes."""

    states = "constrained"
    work = WORK

    @property
    def costs(self) -> Mapping[str, list[int]]:
        """Work of one call: none for functions of the constraints, and systems of them, where there are none."""
        return {} if self.m else {name: [0] * len(WORK) for name in ("g", "G", "Gv_p", "Gv_q", "curvature", "a_p", "solve", "solve_2m")}

    @cached_property
    def constants(self) -> dict[str, bool | int]:
        """Constants of ``kernels/language.py`` that are known from the problem."""
        of_constraints = {"CONSTRAINTS": self.m, "FREE": self.m == 0, "ON_VELOCITIES": self.on_velocities}
        return {"SEPARABLE": self.separable, "QUADRATIC": self.quadratic, **of_constraints}

    def facts(self) -> dict[str, Any]:
        """Return sizes D and M, names of INTEGRALS and POINTS, properties of H, and whether there are CLOSED_FORM, KINETIC_FLOW and CHART.

        ON_VELOCITIES: how many of the M constraints, the last ones, are on velocities.
        CONSTRAINED_BY: what each constraint of a mechanism keeps, in words.
        COORDINATES: the name of each position of a mechanism.
        CANONICAL: the chart has canonical coordinates.
        EXTENDED: the last position is the time. FORCED: there are forces without a potential. DAMPED: those of them that depend on the
        velocity are -c p. For DISTANCES and WATER see :mod:`daebench.compiler.constrained.distances`.
        """
        problem = self.problem
        return {
            "D": self.d,
            "M": self.m,
            "ON_VELOCITIES": self.on_velocities,
            "INTEGRALS": tuple(problem.integrals),
            "CONSTRAINED_BY": problem.parts.constraints if problem.parts else (),
            "COORDINATES": problem.parts.coordinates if problem.parts else (),
            "POINTS": tuple(problem.picture.points) if problem.picture else (),
            "SEPARABLE": self.separable,
            "QUADRATIC": self.quadratic,
            "CHARGED": self.charged,
            "EXPLICIT": self.explicit,
            "CLOSED_FORM": problem.closed_form is not None,
            "KINETIC_FLOW": problem.kinetic_flow is not None,
            "CHART": problem.chart is not None,
            "CANONICAL": self.canonical,
            "EXTENDED": False,
            "FORCED": False,
            "DAMPED": False,
            "DISTANCES": distances(problem) is not None,
            "WATER": is_water(problem),
        }

    def initial(self, name: str, case: Case) -> str:
        """Return the source of name(par), which returns initial p and q, with p_t = 0 and t = 0 if there is a time."""
        return self.text(name, {}, [*case.p, *[0] * self.timed, *case.q, *[0] * self.timed], (2, self.d))

    def algebra(self, target: Target) -> Values:
        """Return the algebra of its vectors, whose norms leave out the time and p_t."""
        return Values(self.d, self.m, self.structure, self.inverse_mass, target, self.coupled, self.timed)

    def monitored(self, names: Sequence[str], kinds: int, stage_multipliers: int, *, arrays: bool = False) -> Monitored:
        """Return the functions that the loop calls besides the step, see :class:`daebench.compiler.monitored.Monitored`."""
        quantities = of_constrained(self.m, len(self.problem.integrals))
        state = State((("x[0]", self.d), ("x[1]", self.d)), self.m, arrays=arrays)
        return Monitored(quantities, state, names, kinds, stage_multipliers, guarded=self.guarded)

    @property
    def sizes(self) -> Mapping[str, int]:
        """Sizes by the letters of shapes."""
        return {"d": self.d, "m": self.m}

    @property
    def named(self) -> Mapping[str, tuple[str, str]]:
        """Functions that are attributes: names of their arguments, and letters of their shapes."""
        given = {"M": ("q", "dd")} if self.mechanical else {}
        always = {"g": ("q", "m"), "G": ("q", "md"), "A": ("q", "md"), "A_qv": ("q v", "md"), "curvature": ("q lam", "dd"), **given}
        return always | (EXPLICIT if self.explicit else IMPLICIT)

    @cached_property
    def _rules(self) -> Rules:
        d, m = self.d, self.m
        q = {"q": list(self.q)}
        pq = {"p": list(self.p), **q}
        rules: Rules = {
            "squares": lambda: (q, [-x.subs(dict.fromkeys(self.q, 0)) for x in self.g], (m,)),
            "integrals": lambda: (pq, list(self.problem.integrals.values()), (len(self.problem.integrals),)),
        }
        if (flow := self.problem.kinetic_flow) is not None:
            rules["kinetic_increment"] = lambda: ({**pq, "time": [flow.t]}, self.kinetic_increment, (2, d))
        return rules | ({"mass": lambda: (pq, self.M, (d, d))} if self.mechanical else {})
