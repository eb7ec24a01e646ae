"""The monitor of a tolerance-driven run on a chain: it monitors whether G keeps its rank, in a number of operations linear in the nodes."""

from collections.abc import Callable

from daebench.methods.solvers.drive import Array
from daebench.methods.solvers.rank_monitor import RankMonitor


class ChainRankMonitor(RankMonitor):
    """A monitor for unknowns that are arrays, without a word on how the force of constraint grew, which takes G as a matrix.

    Its parameters are those of :class:`daebench.methods.solvers.rank_monitor.RankMonitor`.
    """

    def _measure(self) -> Callable[..., float]:
        d, independence = self.dae.d, self.dae.ivp.functions("independence").independence
        return lambda y, par: float(independence(y[d : 2 * d], y[:d], par))

    def _spike(self, y: Array) -> str:
        return ""

    def _keep(self) -> None:
        """Keep nothing: no force is told of."""
