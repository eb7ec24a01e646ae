"""What follows from the definition of a chain: functions of whole states as loops over nodes, for any number of nodes."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from daebench.chains.chain import ConstrainedChain
from daebench.chains.nodes import Nodes
from daebench.chains.watch import ChainWatch
from daebench.derive import Derivation
from daebench.domain import may_be_left_unseen
from daebench.lattice_algebra import Arrays
from daebench.problem import ConstrainedHamiltonian
from daebench.work import WORK

if TYPE_CHECKING:
    from daebench.chains.trace import Tracer
    from daebench.link import Linker


WRITTEN_OUT = 14
"""Positions up to which a chain is written out as values: beyond, straight-line code takes longer to compile than loops, and to run."""


def held(chain: ConstrainedChain, algebra: str) -> ConstrainedHamiltonian | ConstrainedChain:
    """Return a chain for vectors as "values", which is the system written out, or as "arrays"; "" for what suits its size."""
    return chain if algebra == "arrays" or (not algebra and chain.d > WRITTEN_OUT) else chain.written_out()


def derived(chain: ConstrainedChain, algebra: str) -> "Derivation | ChainDerivation":
    """Return what follows from a chain; ``algebra`` as for :func:`held`."""
    found = held(chain, algebra)
    return ChainDerivation(found) if isinstance(found, ConstrainedChain) else Derivation(found)


class ChainDerivation:
    """The functions of one chain, by the names of :class:`daebench.derive.Derivation`.

    Parameters
    ----------
    chain : ConstrainedChain
        The chain.
    """

    states = "constrained"
    work = WORK
    costs: Mapping[str, list[int]] = {}
    explicit = True

    def __init__(self, chain: ConstrainedChain) -> None:
        self.chain, self.d, self.m = chain, chain.d, chain.m
        self.nodes = Nodes(chain)
        self.parameters = list(chain.parameters)

    @cached_property
    def problem(self) -> ConstrainedHamiltonian:
        """The system written out, with a symbol for each coordinate: for few nodes."""
        return self.chain.written_out()

    @property
    def constants(self) -> dict[str, bool | int]:
        """Constants of the hole that the chain settles."""
        return {"SEPARABLE": True, "QUADRATIC": True, "CONSTRAINTS": self.m, "SINGLE": self.m == 1 or not self.chain.diagonal}

    def algebra(self, stages: int, dtype: str) -> Arrays:
        """Return the algebra of its vectors outside of steps."""
        return Arrays(self.d)

    def watch(self, names: Sequence[str], kinds: int, raw: int) -> ChainWatch:
        """Return what the loop does beside stepping."""
        chain = self.chain
        guarded = may_be_left_unseen([chain.U, chain.joint_U], [*chain.before, *chain.here])
        return ChainWatch(self.d, self.m, 0, names, kinds, raw, guarded=guarded)

    def tracer(self, linker: "Linker") -> "Tracer":
        """Return what writes its functions for a linker."""
        from daebench.chains.trace import Tracer

        return Tracer(linker, self.nodes)

    def needs(self, name: str) -> Sequence[str]:
        """Return the names of the chain's other functions that this one calls."""
        return ()

    def source(self, name: str) -> str | None:
        """Return the source of the chain's function of this name: none, for all are written by the tracer."""
        return None
