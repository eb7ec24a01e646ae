"""The runs of one method on a Poisson system in an order study: errors of y."""

from collections.abc import Sequence
from dataclasses import dataclass

from daebench.measurable import PoissonScheme
from daebench.method import Request
from daebench.order_runs import ROUND_OFF, Runs, at_common_times, largest
from daebench.poisson_truth import PoissonTruth
from daebench.scene import Array, PoissonScene
from daebench.trajectory import PoissonTrajectory
from daebench.truth import EPS


@dataclass(frozen=True)
class PoissonBench(Runs):
    """Where the runs of one method are made and held against the reference at the common times.

    Parameters
    ----------
    scene : PoissonScene
        What is solved.
    method : PoissonScheme
        What is measured.
    known : PoissonTruth
        The reference at the common times.
    """

    scene: PoissonScene
    method: PoissonScheme
    known: PoissonTruth
    state = leading = ("y",)

    def _exact(self, name: str) -> Array:
        return self.known.y

    def _floor(self, name: str, h: Sequence[float], errors: Sequence[float]) -> float:
        return max(self.known.bound["y"], ROUND_OFF * EPS * self._size("y"))

    def _run(self, h: float, steps: int, n: int) -> PoissonTrajectory:
        return self.method.solve(self.scene, Request(value=h, steps=steps, every=n, watch=(), count=False))

    def _errors(self, run: PoissonTrajectory, n: int, *, halved: bool) -> tuple[dict[str, float], float]:
        return {"y": largest(at_common_times(run.y) - self.known.y)}, 0.0
