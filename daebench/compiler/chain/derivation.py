"""Functions derived from the definition of a chain: functions of whole states as loops over nodes, for any number of nodes."""

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import sympy as sp

from daebench.compiler.chain.nodes import Nodes
from daebench.compiler.chain.trace import Tracer
from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.derived import Derived
from daebench.compiler.facts import WORK
from daebench.compiler.linear.algebras import Arrays
from daebench.compiler.linear.elimination import Target
from daebench.compiler.monitored import Monitored, State, may_be_left_unseen, of_constrained
from daebench.compiler.syntax import function
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case, ConstrainedHamiltonian
from daebench.systems.picture import Exact

if TYPE_CHECKING:
    from daebench.compiler.link import Linker


WRITTEN_OUT = 14
"""Number of positions up to which a chain is written out as values. Beyond, loops compile and run faster than straight-line code."""

MOST_NAMED = 256
"""Number of nodes up to which the points of a chain have names."""


def held(chain: ConstrainedChain, algebra: str) -> ConstrainedHamiltonian | ConstrainedChain:
    """Return a chain for "arrays", or the system written out for "values"; "" chooses by size."""
    return chain if algebra == "arrays" or (not algebra and chain.d > WRITTEN_OUT) else chain.written_out()


def derived(chain: ConstrainedChain, algebra: str) -> "Derivation | ChainDerivation":
    """Return the derivation of a chain; ``algebra`` as for :func:`held`."""
    system = held(chain, algebra)
    return ChainDerivation(system) if isinstance(system, ConstrainedChain) else Derivation(system)


class ChainDerivation(Derived):
    """The functions of one chain, under the names of :class:`daebench.compiler.constrained.derivation.Derivation`."""

    states = "constrained"
    work = WORK
    explicit = True

    def __init__(self, chain: ConstrainedChain) -> None:
        self.definition, self.chain, self.d, self.m = chain, chain, chain.d, chain.m
        self.nodes = Nodes(chain)
        self.parameters = list(chain.parameters)

    @cached_property
    def problem(self) -> ConstrainedHamiltonian:
        """The system written out, with a symbol for each coordinate; only for few nodes."""
        return self.chain.written_out()

    @property
    def constants(self) -> dict[str, bool | int]:
        """Constants of the scheme language that are known from the chain."""
        return {"SEPARABLE": True, "QUADRATIC": True, "CONSTRAINTS": self.m, "SINGLE": self.m == 1 or not self.chain.diagonal}

    def facts(self) -> dict[str, Any]:
        """Return the facts that ``constrained.derivation`` has, and NODES. Only a short chain has a chart or a closed form.

        POINTS have names up to :data:`MOST_NAMED` nodes. For longer chains they would repeat q.
        """
        picture = self.chain.picture if self.chain.nodes <= MOST_NAMED else None
        return {
            **dict.fromkeys(("CLOSED_FORM", "KINETIC_FLOW", "CHART", "EXTENDED", "FORCED", "DAMPED", "DISTANCES", "WATER"), False),
            **dict.fromkeys(("SEPARABLE", "QUADRATIC"), True),
            "D": self.d,
            "M": self.m,
            "NODES": self.chain.nodes,
            "INTEGRALS": (),
            "POINTS": tuple(picture.points) if picture else (),
            "EXPLICIT": self.chain.diagonal,
        }

    def initial(self, name: str, case: Case) -> str:
        """Return the source of name(par), which returns initial p and q, each shape(d,)."""
        p, q = f"{name}_p", f"{name}_q"
        functions = [self._of_node(q, case.q)]
        functions += self._of_speeds(p, case.p) if self.chain.speeds else [self._of_node(p, case.p)]
        rows = [f"numpy.array([{part}((float(k),), par) for k in range({self.chain.nodes})], dtype=float).ravel()" for part in (p, q)]
        return "\n".join([*functions, function(f"{name}(par)", f"return {', '.join(rows)}")])

    def _of_node(self, name: str, values: Sequence[Exact]) -> str:
        """Source of name(k, par), which returns the values at node k."""
        return self.text(name, {"k": [self.chain.node]}, values)

    def _of_speeds(self, name: str, speeds: Sequence[Exact]) -> list[str]:
        """Source of name(k, par), which returns the momenta of node k, M times the velocities, at the two ends of the chain and within."""
        k, speed = self.chain.node, sp.Matrix([sp.sympify(x) for x in speeds])

        def momenta(end: int) -> list[sp.Expr]:
            blocks = self.chain.inertia(end, k)
            return list(sum((block * speed.subs(k, k + side - 1) for side, block in enumerate(blocks)), sp.zeros(self.chain.b, 1)))

        return self.nodes.at_ends(name, momenta)

    def algebra(self, target: Target) -> Arrays:
        """Return the algebra of its vectors outside of steps."""
        return Arrays(self.d)

    def monitored(self, names: Sequence[str], kinds: int, stage_multipliers: int) -> Monitored:
        """Return the functions that the loop calls besides the step."""
        chain = self.chain
        guarded = may_be_left_unseen([chain.U, chain.joint_U], [*chain.before, *chain.here])
        state = State((("x[0]", self.d), ("x[1]", self.d)), self.m, arrays=True)
        return Monitored(of_constrained(self.m, 0), state, names, kinds, stage_multipliers, guarded=guarded)

    def tracer(self, linker: "Linker") -> Tracer:
        """Return the tracer that writes its functions for a linker."""
        return Tracer(linker, self.nodes)
